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

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replace = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j + 1] + 1, row[j] + 1, replace});
    }
  }
  return row[b.size()];
}

}  // namespace vrpipe
