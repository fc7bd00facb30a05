#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/config_file.h"

namespace CLI {
class App;
}

namespace vrpipe::tools {

/// A subcommand of vrpipe: one file for each, and one line in `all_commands()`.
class Command {
 public:
  virtual ~Command() = default;
  virtual std::string name() const = 0;
  virtual std::string summary() const = 0;  ///< one line, for `vrpipe --help`
  /// Adds options to the command's own part of the command line.
  virtual void declare(CLI::App& app) = 0;
  /// What of the options, which are parsed, a file says; it is applied to them. Throws UserError.
  virtual std::optional<ConfigFile> configuration(CLI::App& app) const { return read_config(app); }
  /// Before run().
  void called_as(Invocation invocation) { invocation_ = std::move(invocation); }
  /// Does it; the options are parsed. Throws UserError, CommandFailure or a fault.
  virtual void run() = 0;

 protected:
  const Invocation& invocation() const { return invocation_; }

 private:
  Invocation invocation_;
};

std::unique_ptr<Command> make_run_command();
std::unique_ptr<Command> make_compare_command();
std::unique_ptr<Command> make_accuracy_command();
std::unique_ptr<Command> make_sweep_command();
std::unique_ptr<Command> make_reproduce_command();
std::unique_ptr<Command> make_microbench_command();
std::unique_ptr<Command> make_convert_command();
std::unique_ptr<Command> make_diff_command();
std::unique_ptr<Command> make_scenes_command();
std::unique_ptr<Command> make_platforms_command();
std::unique_ptr<Command> make_units_command();
std::unique_ptr<Command> make_energies_command();

/// In the order in which `vrpipe --help` lists them.
std::vector<std::unique_ptr<Command>> all_commands();

/// The whole program. Returns the exit code: 0 done, 2 a mistake of the user, 1 a fault of the program; the last two
/// after one line on stderr.
int run_command_line(int argc, const char* const* argv);

}  // namespace vrpipe::tools
