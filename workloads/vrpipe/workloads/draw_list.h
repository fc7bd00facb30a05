#pragma once

#include <vrpipe/pipeline/draw.h>
#include <cstdint>
#include <filesystem>

namespace vrpipe {

/// First four bytes of a .spl file as a little-endian int32: "1SPL".
constexpr std::int32_t kDrawListMagic = 0x4c505331;

struct DrawList {
  Draw draw;
  std::uint64_t splats_in_file = 0;
  std::uint64_t dropped_not_finite = 0;  ///< splats of the file with a NaN or infinite field; not in the draw
};

/// Reads a .spl draw list (little-endian int32 magic, count, width, height; then 12 float32 per splat, see Splat).
/// Splats come in as they are, bit for bit, but for non-finite ones, which are dropped; their depth, which the format does not
/// have, is 0 whatever the file holds in its place. Trailing bytes are ignored.
/// @throws UserError when the file cannot be read, is cut short, is written meanwhile, or is not a draw list
DrawList read_draw_list(const std::filesystem::path& path);

/// Writes a .spl draw list, with 0 in the place of the depth. The file appears complete or not at all.
/// @throws UserError when it cannot be written, or the draw has triangles or is a mesh (the format holds only splats)
void write_draw_list(const std::filesystem::path& path, const Draw& draw);

}  // namespace vrpipe
