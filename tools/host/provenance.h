#pragma once

#include <string>
#include <vector>

namespace vrpipe::tools {

/// A plugin that was loaded, and what was in it.
struct PluginFile {
  std::string path;    ///< as given
  std::string sha256;  ///< of the file, 64 hex digits
};

/// What made a result, beside what the result itself says.
struct Provenance {
  std::vector<std::string> command;  ///< the command line, word by word
  std::vector<PluginFile> plugins;
  std::string config;                        ///< the file of --config; empty for none
  std::vector<std::string> config_settings;  ///< UNIT.PARAMETER of those that it says
  double load_average = 0;                   ///< of the host over the minute before, processes
};

/// Takes note of the plugins and of the host as it is now. Throws UserError for a plugin that cannot be read.
Provenance make_provenance(std::vector<std::string> command, const std::vector<std::string>& plugins);

/// What tells this build of vrpipe from every other: of the files of program and library, 64 hex digits.
std::string build_identity();

/// The command line as a shell takes it: words in single quotes where they need them.
std::string command_text(const Provenance& provenance);

}  // namespace vrpipe::tools
