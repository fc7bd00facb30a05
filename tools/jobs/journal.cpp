#include "jobs/journal.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <regex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>

#include "file_io.h"
#include "host/process_setup.h"
#include "jobs/identity.h"

namespace vrpipe::tools {
namespace {

namespace fs = std::filesystem;
constexpr char kCannotUse[] = "cannot use journal";

std::string describe_error(int error) { return std::generic_category().message(error); }

void say(const std::string& option, const std::string& text) {
  fmt::print(stderr, "{}: {}\n", option, printable(text));
  std::fflush(stderr);
}

/// The first place in which two heads differ, e.g. settings.fidelity.
std::string difference(const nlohmann::json& one, const nlohmann::json& other) {
  const nlohmann::json patch = nlohmann::json::diff(one, other);
  if (patch.empty()) return "form";
  std::string path = patch.front().at("path").get<std::string>();
  path.erase(0, 1);
  std::replace(path.begin(), path.end(), '/', '.');
  return path.empty() ? "form" : path;
}

/// {"sha256":"the first 16 digits","record":RECORD}
constexpr std::size_t digits = 16;
constexpr std::string_view line_start = "{\"sha256\":\"", line_middle = "\",\"record\":";

std::string line_of(const std::string& record) {
  return fmt::format("{}{}{}{}}}\n", line_start, sha256(record).substr(0, digits), line_middle, record);
}

/// The record of a line without its end; none if the line is not what was written.
std::optional<std::string_view> record_in(std::string_view line) {
  const std::size_t before = line_start.size() + digits + line_middle.size();
  if (line.size() <= before) return std::nullopt;
  const std::string_view record = line.substr(before, line.size() - before - 1);
  if (line_of(std::string(record)) != std::string(line) + '\n') return std::nullopt;
  return record;
}

nlohmann::json binaries(nlohmann::json value, unsigned depth) {
  if (depth == 0) throw std::runtime_error("a record goes deeper than any that was written");
  if (!value.is_structured()) return value;
  const auto bytes =
      value.is_object() && value.size() == 2 && value.contains("subtype") ? value.find("bytes") : value.end();
  if (bytes != value.end() && bytes->is_array()) {
    std::vector<std::uint8_t> content;
    for (const nlohmann::json& byte : *bytes) content.push_back(byte.get<std::uint8_t>());
    return nlohmann::json::binary(std::move(content));
  }
  for (nlohmann::json& element : value) element = binaries(std::move(element), depth - 1);
  return value;
}

/// Of runs that nobody took up again; `own` stays.
void remove_abandoned(const fs::path& folder, const fs::path& own) {
  std::error_code error;
  const auto now = fs::file_time_type::clock::now();
  static const std::regex name("[a-z]+-[0-9a-f]{16}\\.jsonl");  // what users name stays
  for (fs::directory_iterator each(folder, error), end; !error && each != end; each.increment(error)) {
    if (each->path() == own || !std::regex_match(each->path().filename().string(), name)) continue;
    std::error_code ignored;
    const auto written = each->last_write_time(ignored);
    if (!ignored && now - written > Journal::kept_in_cache) fs::remove(each->path(), ignored);
  }
}

}  // namespace

nlohmann::json with_binaries(nlohmann::json value) {
  constexpr unsigned deepest = 16;
  return binaries(std::move(value), deepest);
}

Journal::Journal(fs::path path, std::string option, bool is_named)
    : path_(std::move(path)), option_(std::move(option)), is_named_(is_named) {}

Journal::Journal(Journal&& other) noexcept
    : path_(std::move(other.path_)),
      option_(std::move(other.option_)),
      is_named_(other.is_named_),
      descriptor_(std::exchange(other.descriptor_, -1)),
      records_(std::move(other.records_)) {}

Journal::~Journal() { close(); }

void Journal::close() noexcept {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
}

std::optional<fs::path> Journal::path() const {
  return descriptor_ >= 0 ? std::optional<fs::path>(path_) : std::nullopt;
}

Journal Journal::in_file(const fs::path& path, const nlohmann::json& head, const std::string& option) {
  Journal journal(path, option, true);
  journal.open(head);
  return journal;
}

Journal Journal::in_cache(const std::string& name, const nlohmann::json& head, const std::string& option) {
  const std::optional<fs::path> folder = user_cache_folder();
  Journal journal(folder ? *folder / name : fs::path(), option, false);
  std::string why = "neither XDG_CACHE_HOME nor HOME names a folder";
  if (folder) {
    std::error_code error;
    fs::create_directories(*folder, error);
    remove_abandoned(*folder, journal.path_);
    try {
      journal.open(head);
      return journal;
    } catch (const UserError& refused) {
      why = error ? folder->string() + ": " + error.message() : std::string(refused.what());
    }
  }
  journal.close();
  journal.records_.clear();
  say(option, "nothing is stored, so that a run that is interrupted starts anew: " + why);
  return journal;
}

/// Throws UserError.
void Journal::open(const nlohmann::json& head) {
  const std::string where = option_ + " " + path_.string();
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    throw UserError(kCannotUse, where, why, remedy);
  };
  const auto fail = [&](int error) { refuse(describe_error(error), remedy_for_output(error)); };
  // Without O_NONBLOCK a pipe would wait for its other end.
  descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC | O_NONBLOCK, 0666);
  if (descriptor_ < 0) fail(errno);
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) fail(errno);
  if (!S_ISREG(status.st_mode)) refuse("it is not a regular file", "name a file");
  // Of this process alone: simulations in processes of their own do not hold it.
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  if (::fcntl(descriptor_, F_SETLK, &lock) != 0 && (errno == EACCES || errno == EAGAIN)) {
    refuse("another vrpipe is writing it", "wait until that is done, or name another file");
  }
  std::string text(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t count = ::pread(descriptor_, text.data() + done, text.size() - done, static_cast<off_t>(done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(errno);
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
  }
  text.resize(done);

  const std::string first = head.dump() + '\n';
  if (text.size() < first.size() && first.compare(0, text.size(), text) == 0) {
    // New, or its first line was being written.
    if (::ftruncate(descriptor_, 0) != 0) fail(errno);
    const ssize_t written = ::write(descriptor_, first.data(), first.size());
    if (written < 0) fail(errno);
    if (static_cast<std::size_t>(written) != first.size()) fail(ENOSPC);
    if (::fsync(descriptor_) != 0) fail(errno);
  } else if (text.compare(0, first.size(), first) == 0) {
    take_in(text, first);
  } else {
    const nlohmann::json other = nlohmann::json::parse(text.substr(0, text.find('\n')), nullptr, false);
    const bool is_journal = other.is_object() && other.value("schema", nlohmann::json()) == head.at("schema");
    refuse(is_journal ? "it belongs to another run, of which this is different: " + difference(other, head)
                      : std::string("it is no journal of this command"),
           "name another file, or remove it");
  }
  note_written(path_.string(), true);
}

/// What follows the first line; a last line without end is taken off the file. Throws UserError.
void Journal::take_in(const std::string& text, const std::string& first) {
  std::size_t start = first.size();
  for (std::size_t end; (end = text.find('\n', start)) != std::string::npos; start = end + 1) {
    const auto written = record_in(std::string_view(text).substr(start, end - start));
    if (!written) continue;
    nlohmann::json record = nlohmann::json::parse(*written, nullptr, false);
    if (!record.is_discarded()) records_.push_back(std::move(record));
  }
  if (start < text.size() && ::ftruncate(descriptor_, static_cast<off_t>(start)) != 0) {
    const int error = errno;
    throw UserError(kCannotUse, option_ + " " + path_.string(), describe_error(error), remedy_for_output(error));
  }
}

void Journal::append(const nlohmann::json& record) {
  if (descriptor_ < 0) return;
  const std::string line = line_of(record.dump());
  std::size_t done = 0;
  while (done < line.size()) {
    const ssize_t count = ::write(descriptor_, line.data() + done, line.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) break;
    done += static_cast<std::size_t>(count);
  }
  if (done == line.size() && ::fsync(descriptor_) == 0) return;
  say(option_, fmt::format("nothing more is stored: {}: {}", path_.string(), describe_error(errno)));
  close();
}

void Journal::finish() {
  if (descriptor_ >= 0 && !is_named_) ::unlink(path_.c_str());
  close();
}

}  // namespace vrpipe::tools
