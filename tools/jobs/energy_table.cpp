#include "jobs/energy_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <toml++/toml.h>

#include <vrpipe/component/error.h>

#include "jobs/settings.h"
#include "jobs/toml_reader.h"

namespace vrpipe::tools {
namespace {

constexpr const char* cannot_use_table = "cannot use energies";

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == separator) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\n");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\n") - first + 1);
}

bool starts_number(const std::string& text) {
  return !text.empty() && ((text[0] >= '0' && text[0] <= '9') || text[0] == '.' || text[0] == '-');
}

class TableReader : TomlReader {
 public:
  explicit TableReader(const std::string& file)
      : TomlReader(cannot_use_table, file, "as `vrpipe energies --toml` prints it") {}

  EnergyTable read(const std::string& text) const {
    const toml::table root =
        parsed(text, "vrpipe.energies/1", {"schema", "process", "node", "other_process", "event", "power"});
    EnergyTable table;
    GpuProcess& first = table.processes.emplace_back();
    first.name = text_at(root, "process");
    for (const toml::table* each : named(root, "node")) first.nodes.push_back(node(*each));
    for (const toml::table* each : named(root, "other_process")) {
      table.processes.push_back(other_process(*each, table.processes));
    }
    for (const toml::table* each : named(root, "event")) table.events.push_back(event(*each, table.processes));
    for (const toml::table* each : named(root, "power")) table.powers.push_back(power(*each));
    if (table.events.empty()) refuse(root, "it has no event", "write at least one [[event]]");
    return table;
  }

 private:
  Range range(const toml::table& table, const char* key) const {
    const std::string example = "{ low = 1, nominal = 2, high = 3 }";
    const toml::node& found = at(table, key, example);
    if (!found.is_table()) {
      refuse(found, fmt::format("{} is not a range", key), fmt::format("write {} = {}", key, example));
    }
    const toml::table& of = *found.as_table();
    check_keys(of, {"low", "nominal", "high"});
    const auto value = [&](const char* end) { return number(at(of, end, "1"), fmt::format("{} of {}", end, key)); };
    const Range read{value("low"), value("nominal"), value("high")};
    if (!(read.low <= read.nominal && read.nominal <= read.high)) {
      refuse(found, fmt::format("{} is {:g}, {:g}, {:g}", key, read.low, read.nominal, read.high),
             "low may not exceed nominal, nor that high");
    }
    return read;
  }

  /// Tables whose names differ, of events in a unit.
  std::vector<const toml::table*> named(const toml::table& root, const char* key) const {
    std::set<std::pair<std::string, std::string>> names;
    std::vector<const toml::table*> found = tables(root, key);
    for (const toml::table* each : found) {
      const std::string name = text_at(*each, "name");
      const std::string unit = each->contains("unit") ? text_at(*each, "unit") : "";
      if (!names.insert({unit, name}).second) refuse(*each, fmt::format("there are two of '{}'", name), "rename one");
    }
    return found;
  }

  CountProduct product(const toml::node& node, const std::string& text) const {
    CountProduct read;
    for (const std::string& factor : split(text, '*')) {
      const std::vector<std::string> parts = split(factor, '/');
      for (std::size_t i = 0; i < parts.size(); ++i) {
        const std::string part = trimmed(parts[i]);
        const bool divides = i > 0;
        if (part.empty()) refuse(node, fmt::format("'{}' lacks a factor", text), "write e.g. 4 * sm.quads_shaded / 32");
        if (!starts_number(part)) {
          if (divides) refuse(node, fmt::format("'{}' divides by a name", text), "divide by numbers alone");
          read.names.push_back(part);
          continue;
        }
        double value = 0;
        const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
        if (error != std::errc() || end != part.data() + part.size() || !std::isfinite(value) || value <= 0) {
          refuse(node, fmt::format("'{}' in a count is no number above 0", part), "write a number, as 32");
        }
        read.factor = divides ? read.factor / value : read.factor * value;
      }
    }
    return read;
  }

  CountFormula count(const toml::table& table, const char* key = "count") const {
    const toml::node& found = at(table, key, "\"sm.quads_shaded\"");
    CountFormula formula;
    formula.where = line(found.source());
    const auto add = [&](const toml::node& node) {
      const auto text = node.value_exact<std::string>();
      if (!text)
        refuse(node, fmt::format("{} is neither a text nor an array of texts", key),
               "write e.g. \"4 * sm.quads_shaded\"");
      formula.products.push_back(product(node, *text));
      formula.text += (formula.text.empty() ? "" : " + ") + *text;
    };
    if (const toml::array* const all = found.as_array()) {
      for (const toml::node& each : *all) add(each);
    } else {
      add(found);
    }
    if (formula.products.empty()) refuse(found, fmt::format("{} is empty", key), "write e.g. \"sm.quads_shaded\"");
    return formula;
  }

  ProcessNode node(const toml::table& table) const {
    check_keys(table, {"name", "factor", "voltage_ratio", "source"});
    ProcessNode read;
    read.name = text_at(table, "name");
    read.factor = range(table, "factor");
    read.voltage_ratio = number(at(table, "voltage_ratio", "1"), "voltage_ratio");
    read.source = text_at(table, "source");
    return read;
  }

  GpuProcess other_process(const toml::table& table, const std::vector<GpuProcess>& before) const {
    check_keys(table, {"name", "platforms", "leaves_out", "node"});
    GpuProcess read;
    read.name = text_at(table, "name");
    read.platforms = platforms(table);
    if (read.platforms.empty()) {
      refuse(table, fmt::format("'{}' has no platform", read.name), "write e.g. platforms = [\"gh100-gpc\"]");
    }
    for (const GpuProcess& other : before) {
      for (const std::string& platform : other.platforms) {
        if (std::find(read.platforms.begin(), read.platforms.end(), platform) == read.platforms.end()) continue;
        refuse(table, fmt::format("{} is made in '{}' already", platform, other.name), "leave it out of one");
      }
    }
    if (table.contains("leaves_out")) read.leaves_out = text_at(table, "leaves_out");
    const std::vector<const toml::table*> nodes = named(table, "node");
    for (const ProcessNode& needed : before.front().nodes) {
      const auto found = std::find_if(nodes.begin(), nodes.end(),
                                      [&](const toml::table* each) { return text_at(*each, "name") == needed.name; });
      if (found == nodes.end()) {
        refuse(table, fmt::format("'{}' has no node '{}'", read.name, needed.name),
               "write an [[other_process.node]] of that name");
      }
      read.nodes.push_back(node(**found));
    }
    if (nodes.size() != read.nodes.size()) {
      refuse(table, fmt::format("'{}' has a node that no [[node]] is called", read.name), "leave it out, or add one");
    }
    return read;
  }

  std::vector<std::string> platforms(const toml::table& table) const {
    std::vector<std::string> read;
    const toml::node* const found = table.get("platforms");
    if (found == nullptr) return read;
    if (!found->is_array()) refuse(*found, "platforms is no array", "write e.g. [\"agx-orin\"]");
    for (const toml::node& each : *found->as_array()) {
      const auto name = each.value_exact<std::string>();
      if (!name) refuse(each, "a platform is not a text", "write a text in quotes");
      read.push_back(*name);
    }
    return read;
  }

  EnergyEvent event(const toml::table& table, const std::vector<GpuProcess>& processes) const {
    check_keys(table, {"name", "unit", "count", "node", "pj", "source", "meaning"});
    EnergyEvent read;
    read.name = text_at(table, "name");
    read.unit = text_at(table, "unit");
    read.count = count(table);
    read.node = text_at(table, "node");
    std::vector<std::string> names;
    for (const ProcessNode& each : processes.front().nodes) names.push_back(each.name);
    const auto found = std::find(names.begin(), names.end(), read.node);
    if (found == names.end()) {
      refuse(*table.get("node"), fmt::format("there is no node '{}'", read.node),
             names.empty() ? std::string("write a [[node]] of that name") : suggestion(read.node, names));
    }
    read.published = range(table, "pj");
    for (const GpuProcess& process : processes) {
      const Range scaling = process.nodes[static_cast<std::size_t>(found - names.begin())].scaling();
      read.picojoules.push_back({read.published.low * scaling.low, read.published.nominal * scaling.nominal,
                                 read.published.high * scaling.high});
    }
    read.source = text_at(table, "source");
    read.meaning = text_at(table, "meaning");
    return read;
  }

  ConstantPower power(const toml::table& table) const {
    check_keys(table, {"name", "count", "cycles", "watts", "platforms", "source", "meaning"});
    ConstantPower read;
    read.name = text_at(table, "name");
    read.is_of_cycles = table.contains("cycles");
    if (read.is_of_cycles && table.contains("count")) {
      refuse(table, fmt::format("'{}' has a count and cycles", read.name), "leave one out");
    }
    read.count = count(table, read.is_of_cycles ? "cycles" : "count");
    read.watts = range(table, "watts");
    read.platforms = platforms(table);
    read.source = text_at(table, "source");
    read.meaning = text_at(table, "meaning");
    return read;
  }
};

}  // namespace

Range& Range::operator+=(const Range& other) {
  low += other.low;
  nominal += other.nominal;
  high += other.high;
  return *this;
}

std::size_t EnergyTable::process_of(const std::string& platform) const {
  for (std::size_t i = 1; i < processes.size(); ++i) {
    const std::vector<std::string>& of = processes[i].platforms;
    if (std::find(of.begin(), of.end(), platform) != of.end()) return i;
  }
  return 0;
}

bool EnergyTable::is_taken(const ConstantPower& power, const std::string& platform) const {
  const auto is_found = [&](const ConstantPower& each) {
    return std::find(each.platforms.begin(), each.platforms.end(), platform) != each.platforms.end();
  };
  if (power.platforms.empty() || is_found(power)) return true;
  if (std::any_of(powers.begin(), powers.end(), is_found)) return false;
  return std::all_of(power.platforms.begin(), power.platforms.end(),
                     [&](const std::string& other) { return process_of(other) == process_of(platform); });
}

EnergyTable parse_energies(const std::string& text, const std::string& where) { return TableReader(where).read(text); }

EnergyTable read_energies(const std::filesystem::path& path) {
  return parse_energies(table_text(path, "cannot read energies"), path.string());
}

const EnergyTable& shipped_energies() {
  static const EnergyTable table = parse_energies(shipped_energies_text(), "the table that vrpipe comes with");
  return table;
}

void check_energy_names(const EnergyTable& table, const Platform& platform) {
  std::set<std::string> countable(kernel_numbers.begin(), kernel_numbers.end());
  std::set<std::string> others;
  for (const auto& [name, value] : Counts().named()) countable.insert(name);
  for (const ParameterListing& listing : all_parameters(&platform)) {
    for (const Parameter* parameter : listing.parameters->parameters()) {
      const std::string name = listing.unit + "." + parameter->name();
      const bool is_number =
          dynamic_cast<const Integer*>(parameter) != nullptr || dynamic_cast<const Real*>(parameter) != nullptr;
      (is_number ? countable : others).insert(name);
    }
    for (const StatisticReport& statistic : list_statistics(listing)) {
      (statistic.kind == "counter" ? countable : others).insert(statistic.name);
    }
  }
  const auto check = [&](const CountFormula& formula) {
    for (const CountProduct& product : formula.products) {
      for (const std::string& name : product.names) {
        if (countable.count(name) > 0) continue;
        throw UserError(cannot_use_table, formula.where,
                        others.count(name) > 0 ? "'" + name + "' is neither a counter nor a number"
                                               : "nothing counts '" + name + "'",
                        suggestion(name, {countable.begin(), countable.end()}, "`vrpipe units` lists all"));
      }
    }
  };
  for (const EnergyEvent& event : table.events) check(event.count);
  for (const ConstantPower& power : table.powers) check(power.count);
}

}  // namespace vrpipe::tools
