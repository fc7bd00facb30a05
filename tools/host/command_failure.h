#pragma once

#include <stdexcept>
#include <string>

namespace vrpipe::tools {

constexpr int exit_fault = 1;
constexpr int exit_user_error = 2;

/// A failure whose kind and text are already decided, as when it comes from another process.
class CommandFailure : public std::runtime_error {
 public:
  CommandFailure(int code, const std::string& text) : std::runtime_error(text), exit_code(code) {}
  const int exit_code;  ///< exit_user_error or exit_fault
};

/// A simulation that ended in a fault of its own, as it would again.
class SimulationFailure : public CommandFailure {
 public:
  explicit SimulationFailure(const std::string& text) : CommandFailure(exit_fault, text) {}
};

/// What to say and to advise when memory runs out.
constexpr const char* out_of_memory =
    "out of memory; try a smaller --size, fewer --jobs, or smaller queues and bins where --set made them larger";

}  // namespace vrpipe::tools
