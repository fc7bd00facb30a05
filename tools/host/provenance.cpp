#include "host/provenance.h"

#include <sha2.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include <vrpipe/component/error.h>

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

std::string command_text(const Provenance& provenance) {
  std::string text;
  for (const std::string& word : provenance.command) text += (text.empty() ? "" : " ") + quoted(word);
  return text;
}

}  // namespace vrpipe::tools
