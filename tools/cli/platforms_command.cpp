#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/simulation.h>

#include "cli/command_line.h"
#include "cli/listing.h"
#include "cli/options.h"
#include "host/terminal.h"
#include "output/result_json.h"

namespace vrpipe::tools {
namespace {

struct Memory {
  std::string path;
  std::string implementation;
  std::vector<std::string> serves;  ///< units, or memories above, without their GPC
};

std::vector<Memory> memories_of(const Platform& platform) {
  Netlist netlist(platform.gpcs);
  platform.wire(netlist);
  std::vector<Memory> memories;
  for (const Instance& instance : netlist.instances()) {
    if (!Netlist::is_memory(instance)) continue;
    const Slot& slot = Registry::instance().slot(instance.slot);
    Memory& memory = memories.emplace_back();
    memory.path = instance.path;
    memory.implementation = instance.implementation.empty() ? slot.implementation : instance.implementation;
    for (const std::string& path : netlist.bound_to(instance.path)) {
      const std::string unit = without_gpc(path);
      if (std::find(memory.serves.begin(), memory.serves.end(), unit) == memory.serves.end())
        memory.serves.push_back(unit);
    }
  }
  return memories;
}

class PlatformsCommand : public Command {
 public:
  std::string name() const override { return "platforms"; }
  std::string summary() const override { return "the GPUs that can be simulated, and where they differ"; }

  void declare(Arguments& arguments) override {
    arguments.add_option("--plugin", plugins_, "FILE.so", "loads a plugin first; can be repeated", machine_group);
    declare_json(arguments, json_, "list");
    arguments.set_footer("Example:\n  vrpipe compare --platform mobile");
  }

  void run() override {
    load_plugins(plugins_);
    Json list = Json::array();
    std::string text;
    const TextStyle style = stdout_style();
    for (const Platform& platform : platforms()) {
      const bool is_default = &platform == &platforms().front();
      Json differs = Json::object();
      std::string settings;
      std::string line;
      for (const ParameterListing& unit : list_parameters(&platform)) {
        for (const Parameter* parameter : unit.parameters->parameters()) {
          if (parameter->value() == parameter->default_value()) continue;
          differs[unit.unit + "." + parameter->name()] = typed_value(*parameter, parameter->value());
          const std::string setting = fmt::format("{}.{}={}", unit.unit, parameter->name(), parameter->value());
          if (line.size() + setting.size() > 100) {
            settings += "    " + line + "\n";
            line.clear();
          }
          line += (line.empty() ? "" : " ") + setting;
        }
      }
      if (!line.empty()) settings += "    " + line + "\n";
      Json memories = Json::array();
      std::string memory_text;
      for (const Memory& memory : memories_of(platform)) {
        memory_text += fmt::format("{}{} ({}) for {}", memory_text.empty() ? "" : "; ", memory.path,
                                   memory.implementation, fmt::join(memory.serves, ", "));
        memories.push_back(
            {{"path", memory.path}, {"implementation", memory.implementation}, {"serves", memory.serves}});
      }
      list.push_back({{"name", platform.name},
                      {"description", platform.description},
                      {"default", is_default},
                      {"gpcs", platform.gpcs},
                      {"frequency_mhz", platform.frequency_mhz},
                      {"memories", std::move(memories)},
                      {"parameters", std::move(differs)}});
      text +=
          fmt::format("{}{}\n  {}\n", style.bold(platform.name), is_default ? " (default)" : "", platform.description);
      text +=
          fmt::format("  {} GPC{}, {:g} MHz\n", platform.gpcs, platform.gpcs == 1 ? "" : "s", platform.frequency_mhz);
      text += "  memory: " + memory_text + "\n";
      text += settings.empty() ? "  every parameter at its unit's default\n"
                               : "  differs from the units' defaults in\n" + settings;
    }
    text += "`vrpipe units --platform NAME` lists every parameter with its value there\n";
    print_listing({{"schema", "vrpipe.platforms/1"}, {"platforms", std::move(list)}}, text, json_, plugins_);
  }

 private:
  Values plugins_, json_;
};

}  // namespace

std::unique_ptr<Command> make_platforms_command() { return std::make_unique<PlatformsCommand>(); }

}  // namespace vrpipe::tools
