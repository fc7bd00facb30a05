#pragma once

#include <string>

#include <vrpipe/component/error.h>

namespace vrpipe::testing {

/// What an Error says that an action ends with; "none" if it ends without.
template <class Error = UserError, class Action>
std::string refusal_of(Action&& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

}  // namespace vrpipe::testing
