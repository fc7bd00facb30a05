#include "host/provenance.h"

#include <dlfcn.h>
#include <sha2.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {
namespace {

std::string sha256_of(const std::string& path) {
  std::array<char, SHA256_DIGEST_STRING_LENGTH> digits{};
  if (::SHA256File(path.c_str(), digits.data()) == nullptr) {
    throw UserError("cannot read plugin", path, std::strerror(errno), "see that it stays there while vrpipe runs");
  }
  return digits.data();
}

std::string quoted(const std::string& word) {
  constexpr const char* plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789%+,-./:=@_";
  if (!word.empty() && word.find_first_not_of(plain) == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace

Provenance make_provenance(std::vector<std::string> command, const std::vector<std::string>& plugins) {
  Provenance provenance;
  provenance.command = std::move(command);
  for (const std::string& path : plugins) provenance.plugins.push_back({path, sha256_of(path)});
  ::getloadavg(&provenance.load_average, 1);
  return provenance;
}

std::string build_identity() {
  // Where the program is linked with the library as one file, that is hashed twice.
  Dl_info library{};
  std::string digits;
  if (::dladdr(&platforms(), &library) != 0 && library.dli_fname != nullptr) digits = library.dli_fname;
  for (const std::string& file : {std::string("/proc/self/exe"), digits}) {
    std::array<char, SHA256_DIGEST_STRING_LENGTH> of_file{};
    digits += ::SHA256File(file.c_str(), of_file.data()) != nullptr ? std::string(of_file.data()) : "unknown";
  }
  std::array<char, SHA256_DIGEST_STRING_LENGTH> of_both{};
  ::SHA256Data(reinterpret_cast<const std::uint8_t*>(digits.data()), digits.size(), of_both.data());
  return of_both.data();
}

std::string command_text(const Provenance& provenance) {
  std::string text;
  for (const std::string& word : provenance.command) text += (text.empty() ? "" : " ") + quoted(word);
  return text;
}

}  // namespace vrpipe::tools
