#include "cli/command_line.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>

#include "cli/options.h"
#include "host/command_failure.h"

namespace vrpipe::tools {
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

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

/// The name meant, when one is near enough to be a misspelling.
std::string likely_name(const std::string& given, const std::vector<std::string>& known) {
  const std::string nearest = nearest_name(given, known);
  const std::size_t limit = std::max<std::size_t>(2, given.size() / 3);
  return !nearest.empty() && edit_distance(given, nearest) <= limit ? nearest : std::string();
}

[[noreturn]] void refuse_option(const std::string& given, const CLI::App& app, const std::string& where,
                                const std::vector<CLI::App*>& commands) {
  const std::string option = given.substr(0, given.find('='));
  const std::string help = "`" + where + " --help` lists all options";
  for (const CLI::App* command : commands) {
    const std::vector<std::string> known = option_names(*command);
    if (std::find(known.begin(), known.end(), option) == known.end()) continue;
    const std::string owner = "`vrpipe " + command->get_name() + "`";
    throw UserError("unknown option '" + option + "'", where, "it is an option of " + owner,
                    app.get_parent() == nullptr ? "write it after the command" : help);
  }
  const std::string nearest = likely_name(option, option_names(app));
  if (!nearest.empty() && nearest != option) {
    throw UserError("unknown option '" + option + "'", where, "there is no such option",
                    "did you mean " + nearest + "? " + help);
  }
  throw UserError("unknown option '" + option + "'", where, "there is no such option", help);
}

/// An option that swallowed the next one, or was given nothing.
void refuse_missing_values(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& value : option->results()) {
      if (!value.empty() && value.rfind("--", 0) != 0) continue;
      throw UserError("missing value", option->get_name(),
                      value.empty() ? std::string("it is empty") : "the option " + value + " follows it",
                      "write its value after it");
    }
  }
}

/// What the parser left over: CLI11's own message would not say what to do.
void refuse_leftovers(const CLI::App& app, const std::vector<CLI::App*>& commands) {
  const std::vector<std::string> left = app.remaining();
  if (left.empty()) return;
  const bool is_program = app.get_parent() == nullptr;
  const std::string where = is_program ? "vrpipe" : "vrpipe " + app.get_name();
  const std::string& first = left.front();
  if (first.size() > 1 && first[0] == '-') refuse_option(first, app, where, commands);
  if (!is_program) {
    throw UserError("unexpected argument '" + first + "'", where, "the command takes options only",
                    "put the option that it belongs to before it; `" + where + " --help` lists them");
  }
  std::vector<std::string> names;
  for (const CLI::App* command : commands) names.push_back(command->get_name());
  const std::string nearest = likely_name(first, names);
  throw UserError("unknown command '" + first + "'", where, "there is no such command",
                  (nearest.empty() ? std::string() : "did you mean " + nearest + "? ") +
                      fmt::format("use one of {}", fmt::join(names, ", ")));
}

/// CLI11's remaining complaints in our words.
UserError as_user_error(const CLI::ParseError& error, const CLI::App& app) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  const std::string where = chosen.empty() ? "vrpipe" : "vrpipe " + chosen.front()->get_name();
  const std::string remedy = "`" + where + " --help` explains the options";
  const std::string text = error.what();
  const std::string option = text.substr(0, text.find(':'));
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr && option.size() < text.size()) {
    if (text.find("missing") != std::string::npos) {
      return {"missing value", option, "the command line ends after it", "write its value after it; " + remedy};
    }
  }
  const std::size_t name_end = text.find(" was given a disallowed flag override");
  if (name_end != std::string::npos) {
    return {"unexpected value", "--" + text.substr(0, name_end), "it is a switch",
            "write it without `=` and what follows; " + remedy};
  }
  return {"unusable command line", where, text, remedy};
}

int run_parsed(int argc, const char* const* argv) {
  CLI::App app(program_description, "vrpipe");
  app.footer(program_footer);
  app.formatter(help_formatter());
  app.set_help_flag("--help,-h", "explain the command and its options");
  app.set_version_flag("--version", "vrpipe " VRPIPE_VERSION, "print the version");
  app.require_subcommand(0, 1);
  app.allow_extras();

  const std::vector<std::unique_ptr<Command>> commands = all_commands();
  std::vector<CLI::App*> parts;
  for (const auto& command : commands) {
    CLI::App* const part = app.add_subcommand(command->name(), command->summary());
    part->set_help_flag("--help,-h", "explain the command and its options");
    part->group("Commands");
    part->allow_extras();
    command->declare(*part);
    parts.push_back(part);
  }

  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::cout << app.help() << std::flush;
    return 0;
  } catch (const CLI::CallForVersion& version) {
    std::cout << version.what() << '\n' << std::flush;
    return 0;
  } catch (const CLI::ParseError& error) {
    throw as_user_error(error, app);
  }

  refuse_leftovers(app, parts);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!parts[i]->parsed()) continue;
    refuse_missing_values(*parts[i]);
    refuse_leftovers(*parts[i], parts);
    std::optional<ConfigFile> config = commands[i]->configuration(*parts[i]);
    commands[i]->called_as({{argv, argv + argc}, parts[i], config});
    try {
      commands[i]->run();
    } catch (const UserError& error) {
      if (!config) throw;
      throw CommandFailure(exit_user_error, config->located(error.what()));
    }
    return 0;
  }
  std::vector<std::string> names;
  for (const auto& command : commands) names.push_back(command->name());
  throw UserError("no command", "vrpipe", "nothing says what to do",
                  fmt::format("give one of {}, or --help", fmt::join(names, ", ")));
}

}  // namespace

std::vector<std::unique_ptr<Command>> all_commands() {
  std::vector<std::unique_ptr<Command>> commands;
  commands.push_back(make_run_command());
  commands.push_back(make_compare_command());
  commands.push_back(make_accuracy_command());
  commands.push_back(make_sweep_command());
  commands.push_back(make_reproduce_command());
  commands.push_back(make_microbench_command());
  commands.push_back(make_convert_command());
  commands.push_back(make_diff_command());
  commands.push_back(make_scenes_command());
  commands.push_back(make_platforms_command());
  commands.push_back(make_units_command());
  commands.push_back(make_energies_command());
  return commands;
}

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
