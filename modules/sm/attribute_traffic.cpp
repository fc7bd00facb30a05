#include "sm/attribute_traffic.h"

#include <algorithm>
#include <map>

#include <vrpipe/pipeline/geometry.h>

namespace vrpipe {

AttributeTraffic::AttributeTraffic(const RenderContext& context, const AttributeFetch& fetch)
    : context_(context),
      attribute_bytes_(fetch.attribute_bytes),
      buffer_bytes_(fetch.buffer_bytes),
      quad_bytes_(4 * bytes_per_pixel(context.format)),
      tiling_(context.frame->width(), context.frame->height()) {
  const Frame& frame = *context.frame;
  const AddressMap map = address_map(frame, context.format);
  attributes_ = map.attributes.address;
  color_ = map.color.address;
  // Geometries follow one another as they are drawn first.
  std::map<const Draw*, Region> of_geometry;
  Region next{map.vertices.address, map.primitives.address};
  for (const DrawCall& call : frame.draws()) {
    const Draw& geometry = *call.geometry;
    const auto [place, is_new] = of_geometry.emplace(&geometry, next);
    if (is_new) {
      next.splats += vertex_bytes(geometry);
      next.triangles += geometry.triangles.size() * sizeof(ScreenTriangle);
    }
    regions_.push_back(place->second);
  }
}

std::uint32_t AttributeTraffic::visible_triangles(const VertexWarp& warp) const {
  const DrawCall& call = context_.draw(warp.draw);
  const unsigned triangles = primitives_per_splat(call);
  std::uint32_t visible = 0;
  TriangleSnapper snapper(context_);
  PixelRect bounds;
  for (unsigned i = 0; i < warp.splats; ++i) {
    const std::uint32_t splat = warp.first_splat + i;
    if (!is_finite(call, splat)) continue;
    for (unsigned triangle = 0; triangle < triangles; ++triangle) {
      const bool drawn = cull_triangle(context_, snapper, warp.draw, splat, triangle, bounds) == Culling::none;
      visible |= (drawn ? 1U : 0U) << (2 * i + triangle);
    }
  }
  return visible;
}

void AttributeTraffic::find_reads(const Warp& warp, FragmentReads& reads) const {
  if (reads_color(context_.state(warp.quads[0].draw).shader)) return read_color(warp, reads);  // all quads' state
  read_attributes(warp, reads);
}

void AttributeTraffic::read_color(const Warp& warp, FragmentReads& reads) const {
  reads.traffic = MemoryTraffic::color;
  reads.count = 0;
  for (unsigned i = 0; i < warp.count; ++i) {
    const std::uint64_t address = color_ + block_linear(tiling_.place(warp.tile, warp.quads[i].position)) * quad_bytes_;
    const std::uint64_t line = address / line_bytes * line_bytes;
    const auto first = static_cast<unsigned>((address - line) / sector_bytes);
    const unsigned count = std::max(quad_bytes_ / sector_bytes, 1U);
    LineSectors* const end = reads.lines.data() + reads.count;
    LineSectors* const known =
        std::find_if(reads.lines.data(), end, [&](const LineSectors& each) { return each.address == line; });
    if (known == end) reads.lines[reads.count++] = {line, 0};
    known->sectors |= sector_mask(first, count);
  }
}

void AttributeTraffic::read_attributes(const Warp& warp, FragmentReads& reads) const {
  std::array<std::uint32_t, quads_per_warp> seen;
  unsigned primitives = 0;
  reads.traffic = MemoryTraffic::attribute;
  reads.count = 0;
  for (unsigned i = 0; i < warp.count; ++i) {
    const std::uint32_t primitive = primitive_order(warp.quads[i]);
    // The quads of a primitive most often follow one another.
    if (primitives > 0 && seen[primitives - 1] == primitive) continue;
    if (std::find(seen.begin(), seen.begin() + primitives, primitive) != seen.begin() + primitives) continue;
    seen[primitives++] = primitive;
    std::uint64_t address = attributes_ + std::uint64_t{primitive} * primitive_bytes;
    const std::uint64_t end = address + attribute_bytes_;
    while (address < end) {
      const std::uint64_t line = address / line_bytes * line_bytes;
      const std::uint64_t line_end = std::min(end, line + line_bytes);
      const auto first = static_cast<unsigned>((address - line) / sector_bytes);
      const auto past = static_cast<unsigned>((line_end - line + sector_bytes - 1) / sector_bytes);
      reads.lines[reads.count++] = {line, (1U << past) - (1U << first)};
      address = line_end;
    }
  }
}

}  // namespace vrpipe
