#include "cli/arguments.h"

#include <algorithm>
#include <iostream>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <vrpipe/component/error.h>

namespace vrpipe::tools {
namespace {

/// CLI11's layout, with our names of values and without its marks for repeatable options.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() { column_width(34); }
  std::string make_option_opts(const CLI::Option* option) const override {
    return option->get_type_name().empty() ? std::string() : " " + option->get_type_name();
  }
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    std::string text = CLI::Formatter::make_help(app, std::move(name), mode);
    for (std::size_t gap; (gap = text.find("\n\n\n")) != std::string::npos;) text.erase(gap, 1);
    return text;
  }
  std::string make_usage(const CLI::App* app, std::string name) const override {
    const std::string full = name.empty() ? app->get_name() : name;
    std::string text = "\nUsage: " + full + (app->get_subcommands({}).empty() ? " [OPTIONS]" : " COMMAND [OPTIONS]");
    for (const CLI::Option* option : app->get_options([](const CLI::Option* each) { return each->get_positional(); })) {
      text += option->get_required() ? " " + option->get_name(true) : " [" + option->get_name(true) + "]";
    }
    return text + "\n";
  }
};

void set_help(CLI::App& app, const std::string& footer) {
  app.set_help_flag("--help,-h", "explain the command and its options");
  app.footer(footer);
  app.allow_extras();
}

CLI::App* declare_command(CLI::App& program, const Arguments& command) {
  CLI::App* const app = program.add_subcommand(command.command(), command.summary());
  set_help(*app, command.footer());
  app->group("Commands");
  for (const Option& option : command.options()) {
    CLI::Option* const added = option.kind == Option::Kind::flag
                                   ? app->add_flag(option.name)->disable_flag_override()
                                   : app->add_option(option.name)->type_name(option.value_name);
    added->description(option.help)->group(option.group)->required(option.is_required);
    // An option collects its texts, so that one given twice is refused with a message of our own.
    if (option.kind == Option::Kind::text) added->expected(1)->allow_extra_args(false)->take_all();
  }
  return app;
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
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
  const std::string nearest = near_name(option, option_names(app));
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
  const std::string nearest = near_name(first, names);
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

}  // namespace

void Option::give(Values given) {
  texts = std::move(given);
  if (store) store(texts);
}

Arguments::Arguments(std::string command, std::string summary)
    : command_(std::move(command)), summary_(std::move(summary)) {}

Option& Arguments::add(Option option) { return options_.emplace_back(std::move(option)); }

Option& Arguments::add_option(const std::string& name, Values& texts, const std::string& value_name,
                              const std::string& help, const std::string& group) {
  return add({Option::Kind::text, name, value_name, help, group, [&texts](const Values& given) { texts = given; }});
}

Option& Arguments::add_flag(const std::string& name, bool& is_given, const std::string& help,
                            const std::string& group) {
  return add(
      {Option::Kind::flag, name, "", help, group, [&is_given](const Values& given) { is_given = !given.empty(); }});
}

Option& Arguments::add_positional(const std::string& name, std::string& text, const std::string& help) {
  return add({Option::Kind::positional, name, "", help, other_group,
              [&text](const Values& given) { text = given.empty() ? std::string() : given.front(); }});
}

Option* Arguments::find(const std::string& name) {
  const auto found = std::find_if(options_.begin(), options_.end(), [&](const Option& o) { return o.name == name; });
  return found == options_.end() ? nullptr : &*found;
}

const Option* Arguments::find(const std::string& name) const {
  const auto found = std::find_if(options_.begin(), options_.end(), [&](const Option& o) { return o.name == name; });
  return found == options_.end() ? nullptr : &*found;
}

std::optional<std::string> single(const Values& values, const std::string& option) {
  if (values.empty()) return std::nullopt;
  if (values.size() > 1) {
    throw UserError("option given twice", option, "as '" + values[0] + "' and as '" + values[1] + "'", "give it once");
  }
  return values.front();
}

std::optional<std::filesystem::path> single_path(const Values& values, const std::string& option) {
  const auto text = single(values, option);
  return text ? std::optional<std::filesystem::path>(*text) : std::nullopt;
}

std::optional<std::size_t> parse_command_line(int argc, const char* const* argv, const char* description,
                                              const char* footer, std::vector<Arguments>& commands) {
  CLI::App app(description, "vrpipe");
  set_help(app, footer);
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_version_flag("--version", "vrpipe " VRPIPE_VERSION, "print the version");
  app.require_subcommand(0, 1);
  std::vector<CLI::App*> parts;
  for (const Arguments& command : commands) parts.push_back(declare_command(app, command));

  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::cout << app.help() << std::flush;
    return std::nullopt;
  } catch (const CLI::CallForVersion& version) {
    std::cout << version.what() << '\n' << std::flush;
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    throw as_user_error(error, app);
  }

  refuse_leftovers(app, parts);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!parts[i]->parsed()) continue;
    refuse_missing_values(*parts[i]);
    refuse_leftovers(*parts[i], parts);
    for (Option& option : commands[i].options()) option.give(parts[i]->get_option(option.name)->results());
    return i;
  }
  std::vector<std::string> names;
  for (const Arguments& command : commands) names.push_back(command.command());
  throw UserError("no command", "vrpipe", "nothing says what to do",
                  fmt::format("give one of {}, or --help", fmt::join(names, ", ")));
}

}  // namespace vrpipe::tools
