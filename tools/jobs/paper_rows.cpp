#include "jobs/paper_rows.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <toml++/toml.h>

#include <vrpipe/component/error.h>

#include "jobs/reproduce_measures.h"
#include "jobs/toml_reader.h"

namespace vrpipe::tools {
namespace {

template <class Value>
using Named = std::vector<std::pair<std::string, Value>>;

const Named<Verdict> verdicts{{"agrees", Verdict::agrees},           {"differs", Verdict::differs},
                              {"cannot say", Verdict::cannot_say},   {"input", Verdict::input},
                              {"cannot fail", Verdict::cannot_fail}, {"not modelled", Verdict::not_modelled}};
const Named<Verdict> kinds{{"measured", Verdict::cannot_say},
                           {"input", Verdict::input},
                           {"cannot fail", Verdict::cannot_fail},
                           {"not modelled", Verdict::not_modelled}};
const Named<Relation> relations{{"about", Relation::about},
                                {"at most", Relation::at_most},
                                {"at least", Relation::at_least},
                                {"above", Relation::above}};

class RowReader : TomlReader {
 public:
  explicit RowReader(const std::string& file)
      : TomlReader("cannot use rows", file, "as tools/jobs/paper_rows.toml is written") {}

  std::vector<PaperRow> read(const std::string& text) const {
    const toml::table root = parsed(text, "vrpipe.paper-rows/1", {"schema", "row"});
    std::vector<PaperRow> rows;
    std::set<std::string> ids;
    for (const toml::table* each : tables(root, "row")) {
      rows.push_back(row(*each));
      if (!ids.insert(rows.back().id).second)
        refuse(*each->get("id"), "there are two of " + rows.back().id, "rename one");
    }
    if (rows.empty()) refuse(root, "it has no row", "write at least one [[row]]");
    for (const toml::table* each : tables(root, "row")) {
      for (const toml::table* reason : tables(*each, "reason")) {
        if (!reason->contains("row") || ids.count(text_at(*reason, "row")) > 0) continue;
        refuse(*reason->get("row"), "there is no row " + text_at(*reason, "row"), "name the id of a row");
      }
    }
    return rows;
  }

 private:
  std::string text_or_none(const toml::table& table, const char* key) const {
    return table.contains(key) ? text_at(table, key) : "";
  }
  /// A value, or those of an array; none where there is no such key.
  static std::vector<const toml::node*> values(const toml::table& table, const std::string& key) {
    const toml::node* const found = table.get(key);
    std::vector<const toml::node*> all;
    if (found != nullptr && !found->is_array()) all.push_back(found);
    if (found == nullptr || !found->is_array()) return all;
    for (const toml::node& each : *found->as_array()) all.push_back(&each);
    return all;
  }
  template <class Value>
  Value one_of(const Named<Value>& all, const toml::table& table, const char* key) const {
    const std::string text = text_at(table, key);
    std::vector<std::string> names;
    for (const auto& [name, value] : all) {
      if (name == text) return value;
      names.push_back(name);
    }
    refuse(*table.get(key), fmt::format("{} is '{}'", key, text), fmt::format("give {}", fmt::join(names, ", ")));
  }
  std::string text_of(const toml::node& node, const std::string& what) const {
    const auto text = node.value_exact<std::string>();
    if (!text) refuse(node, what + " is not a text", "write a text in quotes");
    return *text;
  }
  std::string measure_name(const toml::node& node) const {
    std::string text = text_of(node, "measure");
    if (is_measure(text)) return text;
    refuse(node, "nothing measures '" + text + "'", suggestion(text, measure_names()));
  }
  std::string quantity_name(const toml::node& node) const {
    std::string text = text_of(node, "a quantity");
    if (find_quantity(text) != nullptr) return text;
    std::vector<std::string> names;
    for (const Quantity& each : quantities()) names.push_back(each.name);
    refuse(node, "there is no quantity '" + text + "'", suggestion(text, names));
  }

  PaperRow row(const toml::table& table) const {
    check_keys(table, {"id", "section", "what", "says", "kind", "published", "unit", "decimals", "relation",
                       "tolerance_percent", "tolerance_reason", "measure", "holds", "how", "why", "reason"});
    PaperRow read;
    read.id = text_at(table, "id");
    read.section = text_at(table, "section");
    read.what = text_at(table, "what");
    read.says = text_at(table, "says");
    read.unjudged = one_of(kinds, table, "kind");
    read.unit = text_or_none(table, "unit");
    if (const toml::node* const decimals = table.get("decimals")) {
      read.decimals = static_cast<unsigned>(std::min(number(*decimals, "decimals"), 9.0));
    }
    for (const toml::node* each : values(table, "measure")) read.measures.push_back(measure_name(*each));
    for (const toml::table* each : tables(table, "holds")) read.holds.push_back(condition(*each));
    for (const toml::node* each : values(table, "published")) {
      read.published.push_back(number(*each, "published"));
      if (read.published.back() == 0) refuse(*each, "published is 0", "write a number above 0");
    }
    if (!read.published.empty()) {
      read.relation = table.contains("relation") ? one_of(relations, table, "relation") : Relation::about;
      if (read.measures.size() != read.published.size()) {
        refuse(table,
               fmt::format("'{}' has {} published numbers and {} measures", read.id, read.published.size(),
                           read.measures.size()),
               "give a measure of each");
      }
    }
    if (const toml::node* const tolerance = table.get("tolerance_percent")) {
      read.tolerance_percent = number(*tolerance, "tolerance_percent");
      read.tolerance_reason = text_at(table, "tolerance_reason");
    }
    if (read.is_judged() && read.published.empty() == read.holds.empty()) {
      refuse(table, "'" + read.id + "' is to be judged", "give either published numbers or holds");
    }
    const bool has_value = !read.measures.empty() || !read.holds.empty();
    read.how = has_value ? text_at(table, "how") : text_or_none(table, "how");
    read.why = read.is_judged() ? text_or_none(table, "why") : text_at(table, "why");
    for (const toml::table* each : tables(table, "reason")) read.reasons.push_back(reason(*each, read));
    return read;
  }

  RowCondition condition(const toml::table& table) const {
    check_keys(table, {"of", "in", "above", "above_in", "below"});
    RowCondition read;
    read.of = quantity_name(at(table, "of", "\"speed-up of het\""));
    for (const toml::node* each : values(table, "in")) read.in.push_back(text_of(*each, "a scene"));
    for (const toml::node* each : values(table, "above_in")) read.than_in.push_back(text_of(*each, "a scene"));
    read.is_above = !table.contains("below");
    for (const toml::node* each : values(table, read.is_above ? "above" : "below")) {
      if (each->is_number()) {
        read.number = number(*each, "a bound");
      } else {
        read.than.push_back(quantity_name(*each));
      }
    }
    if (table.contains("above") + table.contains("above_in") + table.contains("below") != 1) {
      refuse(table, "it compares with nothing, or twice", "give one of above, above_in, below");
    }
    return read;
  }

  RowReason reason(const toml::table& table, const PaperRow& of) const {
    check_keys(table, {"text", "setting", "measure", "row"});
    RowReason read{text_at(table, "text"), text_or_none(table, "setting"), "", text_or_none(table, "row")};
    if (const toml::node* const other = table.get("measure")) read.measure = measure_name(*other);
    if (table.size() != 2) refuse(table, "a reason is shown by one thing", "give a setting, a measure or a row");
    if (!read.setting.empty() && !of.is_of_variants()) {
      refuse(*table.get("setting"), of.id + " is not of the four variants alone, on which settings are tried",
             "give a measure or a row");
    }
    return read;
  }
};

}  // namespace

const char* name_of(Verdict verdict) {
  return std::find_if(verdicts.begin(), verdicts.end(), [&](const auto& each) { return each.second == verdict; })
      ->first.c_str();
}

double PaperRow::number() const {
  if (published.empty()) throw std::logic_error("the paper has no number in row " + id);
  return published.front();
}

std::string PaperRow::text(double value) const {
  const std::string number = fmt::format("{:.{}f}", value, decimals);
  return unit == "/" ? unit + number : number + unit;
}

bool PaperRow::is_of_variants() const {
  return std::all_of(measures.begin(), measures.end(), vrpipe::tools::is_of_variants) &&
         std::all_of(holds.begin(), holds.end(),
                     [](const RowCondition& condition) { return find_quantity(condition.of)->is_of_variants; });
}

std::vector<PaperRow> parse_rows(const std::string& text, const std::string& where) {
  return RowReader(where).read(text);
}

std::vector<PaperRow> read_rows(const std::filesystem::path& path) {
  return parse_rows(table_text(path, "cannot read rows"), path.string());
}

const std::vector<PaperRow>& paper_rows() {
  static const std::vector<PaperRow> rows = parse_rows(shipped_rows_text(), "the rows that vrpipe comes with");
  return rows;
}

const PaperRow& paper_row(const std::string& id) {
  for (const PaperRow& row : paper_rows()) {
    if (id == row.id) return row;
  }
  throw std::logic_error("the paper has no row " + id);
}

double distance(Relation relation, double paper, double measured) {
  switch (relation) {
    case Relation::about: return std::fabs(measured - paper);
    case Relation::at_most: return std::max(0.0, measured - paper);
    case Relation::at_least:
    case Relation::above: return std::max(0.0, paper - measured);
    case Relation::claim: break;
  }
  return 0;
}

Verdict judge(Relation relation, double paper, double tolerance_percent, double measured) {
  // So that what lies on the edge is within.
  constexpr double rounding = 1e-12;
  if (!std::isfinite(measured) || relation == Relation::claim) return Verdict::cannot_say;
  const bool holds = relation == Relation::above
                         ? measured > paper
                         : distance(relation, paper, measured) <= paper * (tolerance_percent / 100 + rounding);
  return holds ? Verdict::agrees : Verdict::differs;
}

std::optional<double> difference_percent(double paper, double measured) {
  if (paper == 0 || !std::isfinite(measured)) return std::nullopt;
  return 100 * (measured - paper) / paper;
}

}  // namespace vrpipe::tools
