#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/arguments.h"
#include "host/provenance.h"

namespace vrpipe::tools {

/// A configuration file (TOML; docs/configuration.md): options of a command without their dashes, [set] and [unit] as
/// tables, [variants.NAME] with base, set and unit. What the command line says as well, it says instead; of [set], [unit]
/// and [variants] key by key. Names of files are relative to the file's folder.
class ConfigFile {
 public:
  /// Reads the file that --config names, and gives options, which are parsed, what they are not given.
  /// Throws UserError with file and line for what is no TOML, an unknown key, with the nearest name, and a value of a type
  /// that the option does not take.
  /// @param others  keys that somebody else reads
  ConfigFile(const std::filesystem::path& path, Arguments& arguments, const std::vector<std::string>& others = {});

  const std::filesystem::path& path() const { return path_; }
  /// Whether an option, or a key of --set, --unit and --define, has its value from here: "--size", "--set tc.bins".
  bool gives(const std::string& what) const;
  /// UNIT.PARAMETER of every setting from here.
  std::vector<std::string> settings() const;
  /// Throws CommandFailure with file and line for a value that the command line takes the place of, and that could not be.
  /// Plugins are loaded by then.
  void check_overridden(const Arguments& arguments) const;
  /// A message with file and line before the option that it is about, if that is from here.
  std::string located(std::string message) const;

 private:
  struct Entry {
    std::string option;  ///< with dashes
    std::string key;     ///< of KEY=VALUE options; empty for others
    std::string text;    ///< as on the command line
    unsigned line = 0;
    bool used = false;  ///< the command line does not say otherwise
    std::string what() const { return key.empty() ? option : option + " " + key; }
  };
  /// A line, and how a message about what it says calls it.
  struct Mention {
    std::string entry;  ///< Entry::what(), of which it is; empty for what somebody else reads
    std::string text;
    unsigned line = 0;
    std::string as_written;  ///< what stands in place of its beginning, to the parenthesis; empty: nothing
  };
  void add(const std::string& option, const std::string& key, const std::string& text, unsigned line);
  /// Of UNIT.PARAMETER or SLOT, wherever it stands.
  void mention(const std::string& entry, const std::string& key, const std::string& value,
               const std::string& as_written, unsigned line);
  /// Of a value that names a file, after NAME= or alone.
  void mention_file(const std::string& entry, const std::string& text, unsigned line);
  void read(Arguments& arguments, const std::vector<std::string>& others);
  void apply(Arguments& arguments);
  std::string place(unsigned line) const;

  std::filesystem::path path_;
  std::vector<Entry> entries_;
  std::vector<Mention> mentions_;
};

/// How a command was called.
struct Invocation {
  std::vector<std::string> words;        ///< the whole command line
  const Arguments* arguments = nullptr;  ///< of the command, parsed
  std::optional<ConfigFile> config;

  bool gives(const std::string& what) const { return config && config->gives(what); }
  void check_overridden() const {
    if (config) config->check_overridden(*arguments);
  }
};

/// What an option is given, with another name for the file if its value names one (help calls it FILE or DIR).
std::string with_file_of(const Option& option, const std::string& text,
                         const std::function<std::filesystem::path(const std::filesystem::path&)>& change);
/// Notes in a result's provenance what a configuration file says of parameters.
void note_config(const Invocation& invocation, Provenance& provenance);
/// --config and --print-config.
void declare_config(Arguments& arguments);
/// Applies --config, if it is given.
std::optional<ConfigFile> read_config(Arguments& arguments);

}  // namespace vrpipe::tools
