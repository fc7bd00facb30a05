#include "jobs/study.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

#include "jobs/toml_file.h"

namespace vrpipe::tools {
namespace {

constexpr std::uint64_t most_points = 1'000'000;
const std::vector<std::string> plain_axes{"scene",    "view",   "size",        "platform",  "variant",
                                          "fidelity", "format", "termination", "multi-pass"};

class StudyReader : public TomlFile {
 public:
  explicit StudyReader(const std::filesystem::path& path)
      : TomlFile(path, "cannot read study", path.string(), "docs/studies.md") {}

  /// By dotted paths; a range is a value.
  static Entries values(const toml::table& table) { return leaves(table, "from"); }

  void check_name(const toml::node& node, const std::string& name) const {
    if (std::find(plain_axes.begin(), plain_axes.end(), name) != plain_axes.end()) return;
    const std::size_t dot = name.rfind('.');
    if (dot != std::string::npos && dot > 0 && dot + 1 < name.size()) return;
    refuse(node, "unknown axis '" + name + "'",
           "it is neither of " + fmt::format("{}", fmt::join(plain_axes, ", ")) + " nor UNIT.PARAMETER",
           suggestion(name, plain_axes));
  }

  StudyAxis axis(const std::string& name, const toml::node& node) const {
    check_name(node, name);
    StudyAxis axis{name, {}, true};
    if (const toml::table* range = node.as_table()) {
      axis.values = values_of_range(*range, name);
    } else if (const toml::array* list = node.as_array()) {
      axis.numeric = std::all_of(list->begin(), list->end(), [](const toml::node& each) { return each.is_number(); });
      for (const toml::node& each : *list) axis.values.push_back(scalar(each, name));
    } else {
      axis.numeric = node.is_number();
      axis.values.push_back(scalar(node, name));
    }
    if (axis.values.empty()) refuse(node, "empty axis '" + name + "'", "it has no value", "give one at least");
    std::set<std::string> seen;
    for (const std::string& value : axis.values) {
      if (!seen.insert(value).second)
        refuse(node, "'" + value + "' given twice", "axis " + name + " has it already", "leave out one");
    }
    return axis;
  }

 private:
  std::vector<std::string> values_of_range(const toml::table& range, const std::string& name) const {
    for (const auto& [key, node] : range) {
      const std::vector<std::string> known{"from", "to", "step", "factor"};
      const std::string text(key.str());
      if (std::find(known.begin(), known.end(), text) == known.end())
        refuse(node, "unknown key '" + text + "'", "a range has from, to and step or factor", suggestion(text, known));
      if (!node.is_number()) refuse(node, "bad value of '" + text + "'", "it is no number", "give a number");
    }
    const auto number = [&](const char* key) { return range[key].value<double>(); };
    const auto from = number("from"), to = number("to"), step = number("step"), factor = number("factor");
    if (!from || !to || step.has_value() == factor.has_value())
      refuse(range, "bad range of '" + name + "'", "it has not from, to and one of step and factor",
             "write e.g. { from = 16, to = 128, factor = 2 }");
    if (!std::isfinite(*from) || !std::isfinite(*to) || *to < *from || (step && !(*step > 0)) ||
        (factor && (!(*factor > 1) || !(*from > 0))))
      refuse(range, "bad range of '" + name + "'", "it never comes to its end",
             "let it rise: to from from, by a step above 0 or a factor above 1");
    const bool whole = range["from"].is_integer() && (step ? range["step"].is_integer() : range["factor"].is_integer());
    std::vector<std::string> values;
    double grown = *from;
    for (std::uint64_t i = 0; values.size() <= most_points; ++i) {
      const double value = step ? *from + static_cast<double>(i) * *step : grown;
      if (factor) grown *= *factor;
      // A hundredth of a step beyond the end is the end, computed otherwise.
      if (value > *to + 0.01 * (step ? *step : value * (*factor - 1))) return values;
      values.push_back(whole ? std::to_string(std::llround(value)) : fmt::format("{:.12g}", value));
    }
    refuse(range, "bad range of '" + name + "'", fmt::format("it has more than {} values", most_points),
           "take a larger step");
  }
};

/// SplitMix64 (Steele et al. 2014), the same everywhere.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t below(std::uint64_t limit) {
    // Without the bias of a remainder.
    const std::uint64_t least = (0 - limit) % limit;
    std::uint64_t value = next();
    while (value < least) value = next();
    return value % limit;
  }

 private:
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15U;
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31U);
  }
  std::uint64_t state_;
};

/// The last axis changes fastest.
StudiedPoint point_of_product(const std::vector<StudyAxis>& axes, std::uint64_t place) {
  StudiedPoint point{std::vector<std::size_t>(axes.size())};
  for (std::size_t i = axes.size(); i-- > 0;) {
    point.values[i] = static_cast<std::size_t>(place % axes[i].values.size());
    place /= axes[i].values.size();
  }
  return point;
}

/// So many different ones below a limit, ascending (Floyd's algorithm).
std::set<std::uint64_t> sample(std::uint64_t limit, std::uint64_t count, std::uint64_t seed) {
  Random random(seed);
  std::set<std::uint64_t> chosen;
  for (std::uint64_t j = limit - count; j < limit; ++j) {
    if (!chosen.insert(random.below(j + 1)).second) chosen.insert(j);
  }
  return chosen;
}

void add_list(const StudyReader& reader, const toml::array& list, Study& study) {
  for (const toml::node& node : list) {
    const toml::table* const table = node.as_table();
    if (table == nullptr) reader.refuse(node, "bad point", "it is no table", "write [[points]], and its keys below");
    const auto entries = StudyReader::values(*table);
    if (study.axes.empty()) {
      for (const auto& [name, value] : entries) {
        reader.check_name(*value, name);
        study.axes.push_back({name, {}, true});
      }
    }
    StudiedPoint point{std::vector<std::size_t>(study.axes.size())};
    if (entries.size() != study.axes.size())
      reader.refuse(*table, "bad point", "it has not the keys of the first point", "give every point the same keys");
    for (const auto& [name, value] : entries) {
      const auto axis = std::find_if(study.axes.begin(), study.axes.end(),
                                     [&, key = &name](const StudyAxis& each) { return each.name == *key; });
      if (axis == study.axes.end())
        reader.refuse(*value, "bad point", "the first point has no '" + name + "'", "give every point the same keys");
      const std::string text = reader.scalar(*value, name);
      axis->numeric = axis->numeric && value->is_number();
      const auto found = std::find(axis->values.begin(), axis->values.end(), text);
      point.values[static_cast<std::size_t>(axis - study.axes.begin())] =
          static_cast<std::size_t>(found - axis->values.begin());
      if (found == axis->values.end()) axis->values.push_back(text);
    }
    const bool is_there = std::any_of(study.points.begin(), study.points.end(),
                                      [&](const StudiedPoint& other) { return other.values == point.values; });
    if (is_there) reader.refuse(*table, "bad point", "it is there twice", "leave it out");
    study.points.push_back(std::move(point));
  }
}

void add_product(const StudyReader& reader, const toml::table& root, Study& study) {
  if (const toml::node* node = root.get("axes")) {
    const toml::table* const table = node->as_table();
    if (table == nullptr)
      reader.refuse(*node, "bad value of 'axes'", "it is no table", "write [axes], and its keys below");
    for (const auto& [name, value] : StudyReader::values(*table)) study.axes.push_back(reader.axis(name, *value));
  }
  study.product = 1;
  for (const StudyAxis& axis : study.axes) {
    if (study.product > std::numeric_limits<std::uint64_t>::max() / axis.values.size())
      reader.refuse(root, "too many points", "their product does not fit 64 bits", "leave out axes or values");
    study.product *= axis.values.size();
  }
  const toml::node* const count = root.get("sample");
  const toml::node* const seed = root.get("seed");
  if (seed != nullptr && (count == nullptr || !seed->is_integer()))
    reader.refuse(*seed, "bad value of 'seed'", count == nullptr ? "there is no sample" : "it is no whole number",
                  count == nullptr ? "add sample = N, or leave it out" : "give a whole number");
  if (seed != nullptr && *seed->value<std::int64_t>() < 0)
    reader.refuse(*seed, "bad value of 'seed'", "it is negative", "give a whole number from 0");
  if (count == nullptr) {
    if (study.product > most_points)
      reader.refuse(root, "too many points", fmt::format("the product has {}", study.product),
                    "leave out axes or values, or take a sample = N of them");
    for (std::uint64_t i = 0; i < study.product; ++i) study.points.push_back(point_of_product(study.axes, i));
    return;
  }
  const auto points = count->value<std::int64_t>().value_or(0);
  if (!count->is_integer() || points < 1 || static_cast<std::uint64_t>(points) > std::min(study.product, most_points))
    reader.refuse(*count, "bad value of 'sample'",
                  fmt::format("it is not a whole number from 1 to the {} points of the product",
                              std::min(study.product, most_points)),
                  "give fewer");
  study.seed = seed == nullptr ? 0 : static_cast<std::uint64_t>(*seed->value<std::int64_t>());
  for (const std::uint64_t place : sample(study.product, static_cast<std::uint64_t>(points), *study.seed))
    study.points.push_back(point_of_product(study.axes, place));
}

}  // namespace

const std::string& text_of(const StudyAxis& axis, std::size_t place) {
  static const std::string none;
  return place == no_value ? none : axis.values[place];
}

std::optional<std::size_t> Study::axis(const std::string& name) const {
  const auto found = std::find_if(axes.begin(), axes.end(), [&](const StudyAxis& each) { return each.name == name; });
  return found == axes.end() ? std::nullopt : std::optional(static_cast<std::size_t>(found - axes.begin()));
}

std::pair<std::size_t, std::size_t> Study::machine_of(const std::vector<std::size_t>& values) const {
  const auto platform = axis("platform"), variant = axis("variant");
  return {platform ? values[*platform] : 0, variant ? values[*variant] : 0};
}

std::vector<std::size_t> Study::without_absent(std::vector<std::size_t> values) const {
  const auto found = absent.find(machine_of(values));
  if (found == absent.end()) return values;
  for (const std::size_t each : found->second) values[each] = no_value;
  return values;
}

void Study::leave_out_absent() {
  std::set<std::vector<std::size_t>> seen;
  std::vector<StudiedPoint> kept;
  for (StudiedPoint& point : points) {
    point.values = without_absent(std::move(point.values));
    if (seen.insert(point.values).second) kept.push_back(std::move(point));
  }
  points = std::move(kept);
}

const std::vector<std::string>& study_keys() {
  static const std::vector<std::string> keys{"axes", "points", "sample", "seed", "columns", "pareto"};
  return keys;
}

Study read_study(const std::filesystem::path& path) {
  const StudyReader reader(path);
  const toml::table& root = reader.root();
  Study study;
  if (const toml::node* points = root.get("points")) {
    for (const char* other : {"axes", "sample", "seed"}) {
      if (root.contains(other))
        reader.refuse(*root.get(other), "points and " + std::string(other), "a list of points is all of a study",
                      "leave out one of them");
    }
    if (points->as_array() == nullptr)
      reader.refuse(*points, "bad value of 'points'", "it is no list", "write [[points]]");
    add_list(reader, *points->as_array(), study);
  } else {
    add_product(reader, root, study);
  }
  if (study.axes.empty()) {
    throw UserError("nothing to study", path.string(), "it has neither points nor axes",
                    "add [axes], e.g. tc.bins = [16, 32, 64]");
  }
  if (const toml::node* columns = root.get("columns")) {
    const toml::array* const list = columns->as_array();
    if (list == nullptr)
      reader.refuse(*columns, "bad value of 'columns'", "it is no list",
                    "write e.g. columns = [\"crop.cache.bytes_filled\"]");
    for (const toml::node& node : *list) {
      const std::string column = reader.scalar(node, "columns");
      if (std::find(study.columns.begin(), study.columns.end(), column) != study.columns.end())
        reader.refuse(node, "bad value of 'columns'", "it has " + column + " twice", "name it once");
      study.columns.push_back(column);
    }
  }
  if (const toml::node* pareto = root.get("pareto")) {
    const toml::array* const list = pareto->as_array();
    if (list == nullptr || list->size() < 2)
      reader.refuse(*pareto, "bad value of 'pareto'", "it is no list of two columns or more",
                    "write e.g. pareto = [\"milliseconds\", \"energy_mj\"]");
    const auto quantity = [](const std::string& column) { return column.substr(column.rfind('-', 0) == 0 ? 1 : 0); };
    for (const toml::node& node : *list) {
      const std::string column = reader.scalar(node, "pareto");
      for (const std::string& other : study.pareto) {
        if (quantity(other) == quantity(column))
          reader.refuse(node, "bad value of 'pareto'", "it has " + quantity(column) + " twice",
                        "take columns of different quantities");
      }
      study.pareto.push_back(column);
    }
  }
  return study;
}

bool follows_the_point(const std::string& axis) {
  return axis == "scene" || axis == "view" || axis == "size" || axis == "fidelity" || axis == "multi-pass" ||
         axis.rfind("preprocess.", 0) == 0;
}

AxisValues parse_axis_values(const std::string& text, const Study& study, const std::string& where) {
  AxisValues values;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t comma = std::min(text.find(',', start), text.size());
    const std::string part = text.substr(start, comma - start);
    start = comma + 1;
    const std::size_t equals = part.find('=');
    if (equals == std::string::npos || equals == 0)
      throw UserError("bad value '" + text + "'", where, "'" + part + "' is not AXIS=VALUE",
                      "give e.g. variant=baseline,tc.bins=32");
    std::string name = part.substr(0, equals), value = part.substr(equals + 1);
    std::vector<std::string> names;
    const StudyAxis* found = nullptr;
    for (const StudyAxis& axis : study.axes) {
      names.push_back(axis.name);
      if (axis.name == name) found = &axis;
    }
    if (found == nullptr)
      throw UserError("unknown axis '" + name + "'", where, "the study has no such axis",
                      names.empty() ? "add it to the study" : suggestion(name, names));
    if (std::find(found->values.begin(), found->values.end(), value) == found->values.end())
      throw UserError("unknown value '" + value + "' of " + name, where, "the axis does not have it",
                      fmt::format("give one of {}", fmt::join(found->values, ", ")));
    values.emplace_back(std::move(name), std::move(value));
  }
  return values;
}

std::vector<std::size_t> reference_values(const Study& study, std::vector<std::size_t> own) {
  for (std::size_t axis = 0; axis < study.axes.size(); ++axis) {
    const StudyAxis& of = study.axes[axis];
    const auto named = std::find_if(study.relative_to.begin(), study.relative_to.end(),
                                    [&](const auto& each) { return each.first == of.name; });
    if (named != study.relative_to.end()) {
      own[axis] =
          static_cast<std::size_t>(std::find(of.values.begin(), of.values.end(), named->second) - of.values.begin());
    } else if (!follows_the_point(of.name)) {
      own[axis] = of.reference;
    }
  }
  return study.without_absent(std::move(own));
}

std::vector<std::optional<std::size_t>> references(const Study& study) {
  std::map<std::vector<std::size_t>, std::size_t> places;
  for (std::size_t i = 0; i < study.points.size(); ++i) places.emplace(study.points[i].values, i);
  std::vector<std::optional<std::size_t>> all;
  for (const StudiedPoint& point : study.points) {
    const auto found = places.find(reference_values(study, point.values));
    all.push_back(found == places.end() ? std::nullopt : std::optional(found->second));
  }
  return all;
}

}  // namespace vrpipe::tools
