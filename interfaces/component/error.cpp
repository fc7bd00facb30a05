#include <vrpipe/component/error.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include <vrpipe/component/printable.h>

namespace vrpipe {

UserError::UserError(const std::string& what, const std::string& where, const std::string& why,
                     const std::string& remedy)
    : std::runtime_error(printable(what + " (" + where + "): " + why + "; " + remedy)),
      parts_(std::make_shared<const std::array<std::string, 4>>(std::array{what, where, why, remedy})) {}

UserError UserError::also_in(const std::string& place) const {
  const auto& [what, where, why, remedy] = *parts_;
  return {what, where + ", " + place, why, remedy};
}

SimulationFault::SimulationFault(const std::string& unit, unsigned long long cycle, const std::string& item)
    : std::logic_error(unit + " at cycle " + std::to_string(cycle) + ": " + item) {}

// The optimal string alignment distance.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1), above, twice_above;
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    twice_above = std::move(above);
    above = row;
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      row[j + 1] = std::min({above[j + 1] + 1, row[j] + 1, above[j] + (a[i] == b[j] ? 0 : 1)});
      const bool is_swapped = i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j];
      if (is_swapped) row[j + 1] = std::min(row[j + 1], twice_above[j - 1] + 1);
    }
  }
  return row[b.size()];
}

std::string near_name(const std::string& name, const std::vector<std::string>& known) {
  std::string best;
  if (name.empty()) return best;
  std::size_t limit = std::max<std::size_t>(1, name.size() / 3);
  const auto consider = [&](const std::string& candidate, const std::string& part) {
    const std::size_t distance = edit_distance(name, part);
    if (distance > limit || (distance == limit && !best.empty())) return;
    best = candidate;
    limit = distance;
  };
  for (const std::string& candidate : known) consider(candidate, candidate);
  if (name.find('.') != std::string::npos) return best;
  for (const std::string& candidate : known) {
    const std::size_t dot = candidate.rfind('.');
    if (dot != std::string::npos) consider(candidate, candidate.substr(dot + 1));
  }
  return best;
}

std::string suggestion(const std::string& name, const std::vector<std::string>& known, const std::string& lists,
                       const std::string& prefix) {
  constexpr std::size_t most_letters = 240;  // of a list that a line has room for
  std::vector<std::string> named;            // once each
  std::string all;
  for (const std::string& each : known) {
    if (std::find(named.begin(), named.end(), each) != named.end()) continue;
    if (all.size() < most_letters) all += (named.empty() ? "" : ", ") + each;
    named.push_back(each);
  }
  const bool is_short = all.size() < most_letters;
  const std::string near = near_name(name, known);
  std::string text = near.empty() ? "" : "did you mean " + prefix + near + "?";
  const auto add = [&](const std::string& more) { text += (text.empty() ? "" : near.empty() ? "; " : " ") + more; };
  if (known.empty()) {
    add("there is none");
  } else if (is_short && (near.empty() || lists.empty())) {
    add((near.empty() ? "there are " : "There are ") + all);
  } else if (lists.empty()) {
    add(std::string(near.empty() ? "there are " : "There are ") + std::to_string(named.size()) + ", such as " +
        known.front());
  }
  if (!lists.empty()) add(lists);
  return text;
}

}  // namespace vrpipe
