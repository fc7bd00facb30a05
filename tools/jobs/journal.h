#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace vrpipe::tools {

/// What a long run has done, in a file, so that the run goes on where it was after it was ended, by whatever. JSON lines:
/// the first says what the others belong to, each other is a record with its checksum. A record is on the disk when append()
/// returns; one that was being written when the run ended, or is not what was written, is left out.
/// One process at a time holds a journal.
class Journal {
 public:
  /// In the user's cache folder, by what it belongs to; removed by finish(). What keeps it from being used is said on
  /// stderr, after `option`, and the run goes on without. Removes others to which nothing was added for `kept_in_cache`.
  static constexpr std::chrono::hours kept_in_cache{30 * 24};
  static Journal in_cache(const std::string& name, const nlohmann::json& head, const std::string& option);
  /// In a file that the user named, which stays.
  /// @throws UserError when it cannot be used, or belongs to something else
  static Journal in_file(const std::filesystem::path& path, const nlohmann::json& head, const std::string& option);
  ~Journal();
  Journal(Journal&& other) noexcept;
  Journal& operator=(Journal&&) = delete;

  /// Of earlier runs, in the order in which they were written. What cannot be read is left out.
  const std::vector<nlohmann::json>& records() const { return records_; }
  bool is_named() const { return is_named_; }
  /// The file; none when the run goes on without.
  std::optional<std::filesystem::path> path() const;
  /// What goes wrong is said on stderr once, and the run goes on without.
  void append(const nlohmann::json& record);
  /// After the last record, when the run's results are safe.
  void finish();

 private:
  Journal(std::filesystem::path path, std::string option, bool is_named);
  void open(const nlohmann::json& head);
  void take_in(const std::string& text, const std::string& first);
  void close() noexcept;

  std::filesystem::path path_;
  std::string option_;
  bool is_named_;
  int descriptor_ = -1;
  std::vector<nlohmann::json> records_;
};

/// Texts of any bytes are JSON as encode() has them; this undoes what a text file does to those that are not UTF-8.
/// @throws std::runtime_error for what goes deeper than a record
nlohmann::json with_binaries(nlohmann::json json);

}  // namespace vrpipe::tools
