#include "cli/command_line.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>

#include "host/command_failure.h"

namespace vrpipe::tools {

/// Every NAME_command.cpp, in the order in which `vrpipe --help` lists them. In the namespace of the functions that it declares.
static std::vector<std::unique_ptr<Command>> all_commands() {
  std::vector<std::unique_ptr<Command>> commands;
#define VRPIPE_COMMAND(NAME)                               \
  extern std::unique_ptr<Command> make_##NAME##_command(); \
  commands.push_back(make_##NAME##_command())
  VRPIPE_COMMAND(run);
  VRPIPE_COMMAND(compare);
  VRPIPE_COMMAND(accuracy);
  VRPIPE_COMMAND(sweep);
  VRPIPE_COMMAND(reproduce);
  VRPIPE_COMMAND(frames);
  VRPIPE_COMMAND(microbench);
  VRPIPE_COMMAND(convert);
  VRPIPE_COMMAND(diff);
  VRPIPE_COMMAND(scenes);
  VRPIPE_COMMAND(platforms);
  VRPIPE_COMMAND(units);
  VRPIPE_COMMAND(energies);
#undef VRPIPE_COMMAND
  return commands;
}

namespace {

constexpr const char* program_description =
    "vrpipe simulates a GPU's graphics pipeline, cycle by cycle, while it draws 3D Gaussian splats,\n"
    "and shows what the extensions of VR-Pipe (HPCA 2025) change: quad merging (qm) and hardware early\n"
    "termination (het).";

constexpr const char* program_footer =
    "Start here:\n"
    "  vrpipe compare                                   the four variants on the built-in scene\n"
    "  vrpipe compare --scene point_cloud.ply --camera cameras.json#3 --output images\n"
    "  vrpipe compare --views 8                         from cameras round it, as a distribution\n"
    "  vrpipe run --variant het --set crop.cache_bytes=32768 --json result.json\n"
    "  vrpipe accuracy --quick --html accuracy.html     what accuracy costs in time\n"
    "  vrpipe reproduce --quick                         the paper's numbers beside what is measured here\n"
    "  vrpipe compare --config study.toml               all of it from a file; --print-config writes one\n"
    "  vrpipe sweep study.toml --html study.html        a study over scenes, GPUs and parameters\n"
    "  vrpipe diff before.json after.json               what differs between two results\n"
    "  vrpipe frames --fidelity lt                      whole frames, in software beside by hardware\n"
    "  vrpipe microbench all --html microbench.html     the paper's analysis of GPUs as workloads\n"
    "  vrpipe units                                     every unit and parameter that can be changed\n"
    "\n"
    "`vrpipe COMMAND --help` explains a command's options.\n"
    "Exit code: 0 done, 2 the command line, a configuration or an input file is wrong, 1 a fault of vrpipe.";

/// One line for one message, whatever a library put into it. That stderr may be closed or full changes nothing else.
void complain(const char* kind, std::string text) {
  std::cout.flush();
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  std::fputs(fmt::format("vrpipe: {}: {}\n", kind, printable(text)).c_str(), stderr);
}

int run_parsed(int argc, const char* const* argv) {
  const std::vector<std::unique_ptr<Command>> commands = all_commands();
  std::vector<Arguments> arguments;
  for (const auto& command : commands) {
    arguments.emplace_back(command->name(), command->summary());
    command->declare(arguments.back());
  }
  const auto called = parse_command_line(argc, argv, program_description, program_footer, arguments);
  if (!called) return 0;
  Command& command = *commands[*called];
  const std::optional<ConfigFile> config = command.configuration(arguments[*called]);
  command.called_as({{argv, argv + argc}, &arguments[*called], config});
  try {
    command.run();
  } catch (const UserError& error) {
    if (!config) throw;
    throw CommandFailure(exit_user_error, config->located(error.what()));
  }
  return 0;
}

}  // namespace

int run_command_line(int argc, const char* const* argv) {
  try {
    const int code = run_parsed(argc, argv);
    std::cout.flush();
    if (!std::cout) {
      throw UserError("cannot write results", "stdout", "it does not take them all",
                      "free some space, or name another place");
    }
    return code;
  } catch (const UserError& error) {
    complain("error", error.what());
    return exit_user_error;
  } catch (const CommandFailure& failure) {
    complain(failure.exit_code == exit_user_error ? "error" : "fault", failure.what());
    return failure.exit_code;
  } catch (const std::bad_alloc&) {
    complain("fault", out_of_memory);
    return exit_fault;
  } catch (const std::exception& fault) {
    complain("fault", fault.what());
    return exit_fault;
  } catch (...) {
    complain("fault", "an exception of unknown type");
    return exit_fault;
  }
}

}  // namespace vrpipe::tools
