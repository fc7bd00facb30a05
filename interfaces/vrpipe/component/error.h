#pragma once

#include <array>
#include <memory>
#include <stdexcept>
#include <string>

namespace vrpipe {

/// A mistake of the user: a command line, a configuration or an input file that cannot be used.
/// The command prints `vrpipe: error: WHAT (WHERE): WHY; WHAT TO DO` and exits with code 2.
class UserError : public std::runtime_error {
 public:
  /// @param what    the thing that is wrong, e.g. "cannot read scene"
  /// @param where   the file, option or property it is wrong in
  /// @param why     what was found
  /// @param remedy  what to do about it, e.g. the allowed values
  UserError(const std::string& what, const std::string& where, const std::string& why, const std::string& remedy);

  /// The same error, somewhere more.
  UserError also_in(const std::string& place) const;

 private:
  std::shared_ptr<const std::array<std::string, 4>> parts_;  ///< shared: an exception is copied without throwing
};

/// A fault of the program itself: a broken invariant of a unit. The command prints it and exits with code 1.
class SimulationFault : public std::logic_error {
 public:
  /// @param unit   the unit in which the invariant broke
  /// @param cycle  the cycle in which it broke
  /// @param item   the item that broke it, in words
  SimulationFault(const std::string& unit, unsigned long long cycle, const std::string& item);
};

/// The name in `known` with the smallest edit distance to `name`; empty when `known` is empty.
template <class Names>
std::string nearest_name(const std::string& name, const Names& known);

std::size_t edit_distance(const std::string& a, const std::string& b);

template <class Names>
std::string nearest_name(const std::string& name, const Names& known) {
  std::string best;
  std::size_t best_distance = 0;
  for (const auto& candidate : known) {
    const std::size_t distance = edit_distance(name, candidate);
    if (best.empty() || distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

}  // namespace vrpipe
