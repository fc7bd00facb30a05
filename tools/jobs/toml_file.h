#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <toml++/toml.h>

namespace vrpipe::tools {

/// A TOML file that a user wrote, and where in it things stand.
class TomlFile {
 public:
  /// @param what   begins messages, e.g. "cannot read study"
  /// @param where  names the file where it cannot be read at all
  /// @param page   of the documentation, which describes such files
  /// Throws UserError for what cannot be read, with its line for what is no TOML.
  TomlFile(const std::filesystem::path& path, const std::string& what, const std::string& where,
           const std::string& page);

  const std::filesystem::path& path() const { return path_; }
  const toml::table& root() const { return root_; }
  [[noreturn]] void refuse(const toml::node& node, const std::string& what, const std::string& why,
                           const std::string& remedy) const;
  /// A text, number, true or false as the command line has it; anything else is refused as the value of `key`.
  std::string scalar(const toml::node& node, const std::string& key) const;

  using Entries = std::vector<std::pair<std::string, const toml::node*>>;
  /// Of a table that dotted keys made, which has no place of its own, that of its first value.
  static toml::source_position position(const toml::node& node);
  /// A table's entries in the order of the file.
  static Entries in_order(const toml::table& table);
  /// All values below a table by their dotted paths, in the order of the file. A table with the key `leaf` is a value.
  static Entries leaves(const toml::table& table, const std::string& leaf = "");

 private:
  std::string place(const toml::source_region& region) const;

  std::filesystem::path path_;
  toml::table root_;
};

/// The text of an option that names a file, with another name for the file; `-` and builtin:NAME stay as they are.
/// @param is_named  whether NAME= may be in front
std::string with_file(const std::string& text, bool is_named,
                      const std::function<std::filesystem::path(const std::filesystem::path&)>& change);
/// A file that a file in `folder` names.
std::filesystem::path in_folder(const std::filesystem::path& folder, const std::filesystem::path& file);

}  // namespace vrpipe::tools
