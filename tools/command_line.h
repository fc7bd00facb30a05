#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

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
  /// The whole command line, before run().
  void called_as(std::vector<std::string> words) { words_ = std::move(words); }
  /// Does it; the options are parsed. Throws UserError, CommandFailure or a fault.
  virtual void run() = 0;

 protected:
  const std::vector<std::string>& command_line() const { return words_; }

 private:
  std::vector<std::string> words_;
};

std::unique_ptr<Command> make_run_command();
std::unique_ptr<Command> make_compare_command();
std::unique_ptr<Command> make_accuracy_command();
std::unique_ptr<Command> make_scenes_command();
std::unique_ptr<Command> make_platforms_command();
std::unique_ptr<Command> make_units_command();

/// In the order in which `vrpipe --help` lists them.
std::vector<std::unique_ptr<Command>> all_commands();

/// A failure whose kind and text are already decided, as when it comes from another process.
class CommandFailure : public std::runtime_error {
 public:
  CommandFailure(int code, const std::string& text) : std::runtime_error(text), exit_code(code) {}
  const int exit_code;  ///< exit_user_error or exit_fault
};

/// What to say and to advise when memory runs out.
constexpr const char* out_of_memory =
    "out of memory; try a smaller --size, fewer --jobs, or smaller queues and bins where --set made them larger";

constexpr int exit_fault = 1;
constexpr int exit_user_error = 2;

/// The whole program. Returns the exit code: 0 done, 2 a mistake of the user, 1 a fault of the program; the last two
/// after one line on stderr.
int run_command_line(int argc, const char* const* argv);

}  // namespace vrpipe::tools
