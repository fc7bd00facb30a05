#pragma once

#include <string>
#include <vector>

#include "output/reproduce_tables.h"

namespace vrpipe::tools {

/// A riddle of the paper's numbers, and what the points say of it.
struct Answer {
  std::string question;
  std::string text;
};
std::vector<Answer> answers(const Reproduction& of);

}  // namespace vrpipe::tools
