#pragma once

#include <cstddef>
#include <cstdint>

#include <vrpipe/pipeline/frame.h>

namespace vrpipe::testing {

/// Of marks in a list of numbers of warps.
constexpr std::uint32_t marks_from = 1000;
constexpr std::uint32_t mark_number(Mark mark) { return marks_from + static_cast<std::uint32_t>(mark); }
inline std::uint32_t mark_number(std::size_t command) { return mark_number(Frame::mark_of(command)); }

}  // namespace vrpipe::testing
