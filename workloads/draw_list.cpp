#include <vrpipe/workloads/draw_list.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/camera.h>

#include "file_io.h"

namespace vrpipe {
namespace {

constexpr char kCannotRead[] = "cannot read draw list";

struct DrawListHeader {
  std::int32_t magic, count, width, height;
};
static_assert(sizeof(DrawListHeader) == 16, "four int32 without padding");

bool is_finite(const Splat& splat) {
  std::array<float, 12> fields;
  std::memcpy(fields.data(), &splat, sizeof splat);
  for (const float field : fields) {
    if (!std::isfinite(field)) return false;
  }
  return true;
}

}  // namespace

DrawList read_draw_list(const std::filesystem::path& path) {
  const std::string where = path.string();
  const InputFile file(path, kCannotRead);
  DrawListHeader header{};
  file.read(0, &header, static_cast<std::size_t>(std::min<std::uint64_t>(file.size(), sizeof header)));
  if (file.size() < sizeof header.magic || header.magic != kDrawListMagic) {
    throw UserError(kCannotRead, where, "it does not begin with the draw list's magic number 0x4c505331 (\"1SPL\")",
                    "write one with --save-draw");
  }
  if (file.size() < sizeof header) {
    throw UserError(kCannotRead, where, "its header needs 16 bytes, and the file has " + std::to_string(file.size()),
                    "get or write the file again");
  }
  if (header.count < 0) {
    throw UserError(kCannotRead, where, "its header announces " + std::to_string(header.count) + " splats",
                    "get or write the file again");
  }
  const auto in_range = [](std::int32_t side) { return side >= 1 && side <= static_cast<std::int32_t>(kMaxImageSize); };
  if (!in_range(header.width) || !in_range(header.height)) {
    throw UserError(kCannotRead, where,
                    "its image size is " + std::to_string(header.width) + "x" + std::to_string(header.height),
                    "both sides must be 1 to " + std::to_string(kMaxImageSize));
  }
  DrawList list;
  list.splats_in_file = static_cast<std::uint64_t>(header.count);
  const std::uint64_t expected = sizeof header + list.splats_in_file * sizeof(Splat);
  if (file.size() < expected) {
    throw UserError(kCannotRead, where,
                    std::to_string(header.count) + " splats need " + std::to_string(expected) +
                        " bytes, and the file has " + std::to_string(file.size()),
                    "get or write the file again, it seems cut short");
  }
  list.draw.width = static_cast<std::uint32_t>(header.width);
  list.draw.height = static_cast<std::uint32_t>(header.height);
  std::vector<Splat>& splats = list.draw.splats;
  splats.resize(static_cast<std::size_t>(list.splats_in_file));
  file.read(sizeof header, splats.data(), splats.size() * sizeof(Splat));
  file.check_unchanged();
  const auto is_broken = [](const Splat& splat) { return !is_finite(splat); };
  splats.erase(std::remove_if(splats.begin(), splats.end(), is_broken), splats.end());
  list.dropped_not_finite = list.splats_in_file - splats.size();
  for (Splat& splat : splats) splat.depth = 0;
  return list;
}

void write_draw_list(const std::filesystem::path& path, const Draw& draw) {
  constexpr char kCannotWrite[] = "cannot write draw list";
  if (!draw.triangles.empty() || draw.is_mesh()) {
    throw UserError(kCannotWrite, path.string(),
                    draw.is_mesh() ? "the draw is a mesh" : "the draw has triangles of its own",
                    "a .spl holds splats only; save a draw that comes from a scene");
  }
  if (draw.splats.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
    throw UserError(kCannotWrite, path.string(), "the draw has " + std::to_string(draw.splats.size()) + " splats",
                    "a .spl holds at most 2^31-1; use a smaller scene");
  }
  check_image_size(draw.width, draw.height, path.string());
  const DrawListHeader header{kDrawListMagic, static_cast<std::int32_t>(draw.splats.size()),
                              static_cast<std::int32_t>(draw.width), static_cast<std::int32_t>(draw.height)};
  AtomicFile file(path, kCannotWrite, path.string());
  file.write(&header, sizeof header);
  for (Splat splat : draw.splats) {
    splat.depth = 0;
    file.write(&splat, sizeof splat);
  }
  file.commit();
}

}  // namespace vrpipe
