#pragma once

#include <array>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

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

/// Letters put in, left out, replaced, or swapped with the next one, to make `b` of `a`.
std::size_t edit_distance(const std::string& a, const std::string& b);

/// The one of `known` that `name` misspells: the nearest, if no more than a third of the letters are wrong (of three
/// letters or fewer, one). A name without dots may be the last part of one with some. Empty when none is near.
std::string near_name(const std::string& name, const std::vector<std::string>& known);

/// What to do about a `name` that is none of those `known`: "did you mean NAME?", where one is near, and which there are.
/// @param lists   where all are listed, e.g. "`vrpipe units` lists all"; without it they are named here
/// @param prefix  what stands before the one suggested where it is written, e.g. "builtin:"
std::string suggestion(const std::string& name, const std::vector<std::string>& known, const std::string& lists = "",
                       const std::string& prefix = "");

}  // namespace vrpipe
