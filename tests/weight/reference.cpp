// The unit in which check_weight weighs the build: a source like the project's own, which nothing uses. Whoever changes it
// measures check_weight's constant anew.
#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <systemc>
#include <tlm>

namespace vrpipe::weight {

template <unsigned Kind>
std::string described(const std::map<std::string, std::vector<double>>& rows) {
  std::vector<std::pair<std::string, double>> sums;
  for (const auto& [name, values] : rows) {
    double sum = Kind;
    for (const double value : values) sum += value * static_cast<double>(Kind + 1);
    sums.emplace_back(name, sum);
  }
  std::sort(sums.begin(), sums.end(), [](const auto& a, const auto& b) { return a.second + Kind < b.second; });
  std::string text;
  for (const auto& [name, sum] : sums) text += fmt::format("{:>{}} {:.3f}\n", name, 10 + Kind, sum);
  return text;
}

std::vector<std::function<std::string(const std::map<std::string, std::vector<double>>&)>> all() {
  return {described<0>, described<1>, described<2>, described<3>,
          described<4>, described<5>, described<6>, described<7>};
}

}  // namespace vrpipe::weight
