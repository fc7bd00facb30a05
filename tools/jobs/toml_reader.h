#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <toml++/toml.h>

namespace vrpipe::tools {

/// Reads a table of figures in TOML; a mistake is a UserError that names the line and what to do.
class TomlReader {
 public:
  /// @param what    begins messages, e.g. "cannot use energies"
  /// @param file    in messages
  /// @param example where a table that can be read is found, e.g. "as `vrpipe energies --toml` prints it"
  TomlReader(std::string what, std::string file, std::string example)
      : what_(std::move(what)), file_(std::move(file)), example_(std::move(example)) {}

  /// A file of that schema with these keys at its top.
  toml::table parsed(const std::string& text, const std::string& schema, const std::vector<std::string>& keys) const;
  std::string line(const toml::source_region& source) const;
  [[noreturn]] void refuse(const toml::node& where, const std::string& why, const std::string& remedy) const;
  void check_keys(const toml::table& table, const std::vector<std::string>& known) const;
  /// The tables of [[key]]; none where there is no such key.
  std::vector<const toml::table*> tables(const toml::table& parent, const char* key) const;

  /// Of a key that has to be there.
  const toml::node& at(const toml::table& table, const char* key, const std::string& example) const;
  std::string text_at(const toml::table& table, const char* key) const;
  /// A finite number of at least 0.
  double number(const toml::node& node, const std::string& what) const;

 private:
  std::string what_, file_, example_;
};

/// A file of a user's. Throws UserError, which begins with `what`.
std::string table_text(const std::filesystem::path& path, const std::string& what);

}  // namespace vrpipe::tools
