#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/arguments.h"
#include "cli/config_file.h"

namespace vrpipe::tools {

/// A subcommand of vrpipe: NAME_command.cpp has it, and command_line.cpp lists it.
class Command {
 public:
  virtual ~Command() = default;
  virtual std::string name() const = 0;
  virtual std::string summary() const = 0;  ///< one line, for `vrpipe --help`
  /// Adds options to the command's own part of the command line.
  virtual void declare(Arguments& arguments) = 0;
  /// What of the options, which are parsed, a file says; it is applied to them. Throws UserError.
  virtual std::optional<ConfigFile> configuration(Arguments& arguments) const { return read_config(arguments); }
  /// Before run().
  void called_as(Invocation invocation) { invocation_ = std::move(invocation); }
  /// Does it; the options are parsed. Throws UserError, CommandFailure or a fault.
  virtual void run() = 0;

 protected:
  const Invocation& invocation() const { return invocation_; }

 private:
  Invocation invocation_;
};

/// The whole program. Returns the exit code: 0 done, 2 a mistake of the user, 1 a fault of the program; the last two
/// after one line on stderr.
int run_command_line(int argc, const char* const* argv);

}  // namespace vrpipe::tools
