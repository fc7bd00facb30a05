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

/// Cycles over those of the run are how many are active.
std::string how_many(const ConstantPower& power) {
  const std::string text = printable(power.count.text);
  return power.is_of_cycles ? "(" + text + ") / cycles" : text;
}

std::string energies_as_text(const EnergyTable& table, const TextStyle& style) {
  constexpr std::size_t width = 120;
  std::vector<std::string> heading{"unit: event, and how often"};
  for (const GpuProcess& process : table.processes) heading.push_back("pJ at " + printable(process.name));
  TextTable events(heading);
  for (const EnergyEvent& event : table.events) {
    std::vector<std::string> row{printable(event.unit + ": " + event.name)};
    for (const Range& each : event.picojoules) row.push_back(range_text(each));
    events.row(std::move(row));
    events.below(printable(event.count.text), width);
  }
  TextTable powers({"constant power", "W", "how many"});
  powers.left(2);
  for (const ConstantPower& power : table.powers) {
    powers.row({printable(power.name), range_text(power.watts), how_many(power)});
  }
  return events.text(style) + "\n" + powers.text(style) +
         "low / nominal / high; sources: --markdown; to change them: --toml, then `vrpipe compare --energies FILE`\n";
}

/// What the documentation holds.
std::string energies_as_markdown(const EnergyTable& table) {
  std::string text = "| unit: event | pJ as published |";
  std::string rule = "|---|---|";
  for (const GpuProcess& process : table.processes) {
    text += fmt::format(" pJ at {} |", markdown_escaped(process.name));
    rule += "---|";
  }
  text += " how often | what, and source |\n" + rule + "---|---|\n";
  for (const EnergyEvent& event : table.events) {
    text += fmt::format("| {}: {} | {}, {} |", markdown_escaped(event.unit), markdown_escaped(event.name),
                        range_text(event.published), markdown_escaped(event.node));
    for (const Range& each : event.picojoules) text += fmt::format(" {} |", range_text(each));
    text += fmt::format(" {} | {}. {} |\n", markdown_escaped(event.count.text), markdown_escaped(event.meaning),
                        markdown_escaped(event.source));
  }
  text += "\n| from | to | of | factor | supply, of that | source |\n|---|---|---|---|---|---|\n";
  for (const GpuProcess& process : table.processes) {
    const std::string of =
        process.platforms.empty() ? "all others" : fmt::format("{}", fmt::join(process.platforms, ", "));
    for (const ProcessNode& node : process.nodes) {
      text += fmt::format("| {} | {} | {} | {} | {:g} | {} |\n", markdown_escaped(node.name),
                          markdown_escaped(process.name), markdown_escaped(of), range_text(node.factor),
                          node.voltage_ratio, markdown_escaped(node.source));
    }
  }
  text += "\n| constant power | W | how many | of | what, and source |\n|---|---|---|---|---|\n";
  for (const ConstantPower& power : table.powers) {
    text += fmt::format("| {} | {} | {} | {} | {}. {} |\n", markdown_escaped(power.name), range_text(power.watts),
                        markdown_escaped(how_many(power)),
                        markdown_escaped(fmt::format("{}", fmt::join(power.platforms, ", "))),
                        markdown_escaped(power.meaning), markdown_escaped(power.source));
  }
  return text;
}

Json nodes_json(const GpuProcess& process) {
  Json nodes = Json::array();
  for (const ProcessNode& node : process.nodes) {
    nodes.push_back({{"name", node.name},
                     {"factor", range_json(node.factor)},
                     {"voltage_ratio", node.voltage_ratio},
                     {"source", node.source}});
  }
  return nodes;
}

Json energies_as_json(const EnergyTable& table) {
  Json others = Json::array(), events = Json::array(), powers = Json::array();
  for (std::size_t i = 1; i < table.processes.size(); ++i) {
    const GpuProcess& process = table.processes[i];
    others.push_back({{"name", process.name},
                      {"platforms", process.platforms},
                      {"leaves_out", process.leaves_out.empty() ? Json() : Json(process.leaves_out)},
                      {"nodes", nodes_json(process)}});
  }
  for (const EnergyEvent& event : table.events) {
    Json elsewhere = Json::array();
    for (std::size_t i = 1; i < event.picojoules.size(); ++i) elsewhere.push_back(range_json(event.picojoules[i]));
    events.push_back({{"name", event.name},
                      {"unit", event.unit},
                      {"count", event.count.text},
                      {"node", event.node},
                      {"published_picojoules", range_json(event.published)},
                      {"picojoules", range_json(event.picojoules.front())},
                      {"picojoules_in_other_processes", std::move(elsewhere)},
                      {"source", event.source},
                      {"meaning", event.meaning}});
  }
  for (const ConstantPower& power : table.powers) {
    powers.push_back({{"name", power.name},
                      {"count", power.count.text},
                      {"is_of_cycles", power.is_of_cycles},
                      {"watts", range_json(power.watts)},
                      {"platforms", power.platforms},
                      {"source", power.source},
                      {"meaning", power.meaning}});
  }
  return {{"schema", "vrpipe.energies/1"},
          {"process", table.processes.front().name},
          {"nodes", nodes_json(table.processes.front())},
          {"other_processes", std::move(others)},
          {"events", std::move(events)},
          {"powers", std::move(powers)}};
}

class EnergiesCommand : public Command {
 public:
  std::string name() const override { return "energies"; }
  std::string summary() const override {
    return "what events and active time cost, by which --energy reports; or checks a file of them";
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
