#pragma once

#include <string>

#include <vrpipe/component/error.h>

namespace vrpipe::testing {

/// What a UserError says that an action ends with; "none" if it ends without.
template <class Action>
std::string refusal_of(Action&& action) {
  try {
    action();
  } catch (const UserError& error) {
    return error.what();
  }
  return "none";
}

}  // namespace vrpipe::testing
