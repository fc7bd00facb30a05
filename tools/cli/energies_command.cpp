#include <iostream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>

#include "cli/command_line.h"
#include "cli/listing.h"
#include "cli/options.h"
#include "host/stdout_to_stderr.h"
#include "host/terminal.h"
#include "jobs/energy_table.h"
#include "output/energy_report.h"
#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

std::string range_text(const Range& range) {
  return fmt::format("{:.3g} / {:.3g} / {:.3g}", range.low, range.nominal, range.high);
}

std::string energies_as_text(const EnergyTable& table, const TextStyle& style) {
  constexpr std::size_t width = 120;
  TextTable events({"unit: event", fmt::format("pJ at {}", printable(table.process)), "how often"});
  events.left(2);
  events.wrap(width);
  for (const EnergyEvent& event : table.events) {
    events.row({printable(event.unit + ": " + event.name), range_text(event.picojoules), printable(event.count.text)});
  }
  TextTable powers({"constant power", "W", "how often"});
  powers.left(2);
  for (const ConstantPower& power : table.powers) {
    powers.row({printable(power.name), range_text(power.watts), printable(power.count.text)});
  }
  return events.text(style) + "\n" + powers.text(style) +
         "low / nominal / high; sources: --markdown; to change them: --toml, then `vrpipe compare --energies FILE`\n";
}

/// What the documentation holds.
std::string energies_as_markdown(const EnergyTable& table) {
  std::string text = fmt::format("| unit: event | pJ as published | pJ at {} | how often | what, and source |\n",
                                 markdown_escaped(table.process)) +
                     "|---|---|---|---|---|\n";
  for (const EnergyEvent& event : table.events) {
    text += fmt::format("| {}: {} | {}, {} | {} | {} | {}. {} |\n", markdown_escaped(event.unit),
                        markdown_escaped(event.name), range_text(event.published), markdown_escaped(event.node),
                        range_text(event.picojoules), markdown_escaped(event.count.text),
                        markdown_escaped(event.meaning), markdown_escaped(event.source));
  }
  text += fmt::format("\n| process | factor to {} | supply, of that | source |\n|---|---|---|---|\n",
                      markdown_escaped(table.process));
  for (const ProcessNode& node : table.nodes) {
    text += fmt::format("| {} | {} | {:g} | {} |\n", markdown_escaped(node.name), range_text(node.factor),
                        node.voltage_ratio, markdown_escaped(node.source));
  }
  text += "\n| constant power | W | how often | of | what, and source |\n|---|---|---|---|---|\n";
  for (const ConstantPower& power : table.powers) {
    text += fmt::format("| {} | {} | {} | {} | {}. {} |\n", markdown_escaped(power.name), range_text(power.watts),
                        markdown_escaped(power.count.text),
                        markdown_escaped(fmt::format("{}", fmt::join(power.platforms, ", "))),
                        markdown_escaped(power.meaning), markdown_escaped(power.source));
  }
  return text;
}

Json range_json(const Range& range) { return {{"low", range.low}, {"nominal", range.nominal}, {"high", range.high}}; }

Json energies_as_json(const EnergyTable& table) {
  Json nodes = Json::array(), events = Json::array(), powers = Json::array();
  for (const ProcessNode& node : table.nodes) {
    nodes.push_back({{"name", node.name},
                     {"factor", range_json(node.factor)},
                     {"voltage_ratio", node.voltage_ratio},
                     {"source", node.source}});
  }
  for (const EnergyEvent& event : table.events) {
    events.push_back({{"name", event.name},
                      {"unit", event.unit},
                      {"count", event.count.text},
                      {"node", event.node},
                      {"published_picojoules", range_json(event.published)},
                      {"picojoules", range_json(event.picojoules)},
                      {"source", event.source},
                      {"meaning", event.meaning}});
  }
  for (const ConstantPower& power : table.powers) {
    powers.push_back({{"name", power.name},
                      {"count", power.count.text},
                      {"watts", range_json(power.watts)},
                      {"platforms", power.platforms},
                      {"source", power.source},
                      {"meaning", power.meaning}});
  }
  return {{"schema", "vrpipe.energies/1"},
          {"process", table.process},
          {"nodes", std::move(nodes)},
          {"events", std::move(events)},
          {"powers", std::move(powers)}};
}

class EnergiesCommand : public Command {
 public:
  std::string name() const override { return "energies"; }
  std::string summary() const override {
    return "what events cost, by which --energy reports; or checks a file of them";
  }

  void declare(Arguments& arguments) override {
    arguments.add_positional("FILE.toml", file_, "a table of your own, as --energies takes it");
    arguments.add_option("--platform", platform_, "NAME",
                         "whose units have to have what the file counts (default: " + platforms().front().name + ")",
                         listed_group);
    arguments.add_option("--plugin", plugins_, "FILE.so", "loads a plugin's units first; can be repeated",
                         listed_group);
    arguments.add_flag("--toml", toml_, "prints the table that vrpipe comes with as a file, to begin with",
                       result_group);
    arguments.add_flag("--markdown", markdown_, "prints the table as Markdown, with sources", result_group);
    declare_json(arguments, json_, "list");
    arguments.set_footer(
        "Examples:\n"
        "  vrpipe energies\n"
        "  vrpipe energies --toml > mine.toml\n"
        "  vrpipe energies mine.toml\n"
        "  vrpipe compare --energies mine.toml");
  }

  void run() override {
    check_one_form("--markdown", markdown_, json_);
    if (toml_ && (markdown_ || !file_.empty() || !json_.empty())) {
      throw UserError("cannot print both", "--toml", "it prints the table that vrpipe comes with, as a file",
                      "leave out " + std::string(markdown_        ? "--markdown"
                                                 : !file_.empty() ? "FILE"
                                                                  : "--json"));
    }
    load_plugins(plugins_);
    const auto named = single(platform_, "--platform");
    const Platform& platform = named ? platform_named(*named) : platforms().front();
    if (toml_) {
      std::cout << shipped_energies_text();
      return;
    }
    const EnergyTable table = file_.empty() ? shipped_energies() : read_energies(file_);
    {
      const StdoutToStderr redirected;  // plugins may print while their units are made
      check_energy_names(table, platform);
    }
    print_listing(energies_as_json(table),
                  markdown_ ? energies_as_markdown(table) : energies_as_text(table, stdout_style()), json_, plugins_);
  }

 private:
  std::string file_;
  Values platform_, plugins_, json_;
  bool toml_ = false;
  bool markdown_ = false;
};

}  // namespace

std::unique_ptr<Command> make_energies_command() { return std::make_unique<EnergiesCommand>(); }

}  // namespace vrpipe::tools
