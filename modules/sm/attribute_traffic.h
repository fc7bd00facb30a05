#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <vrpipe/arithmetic/divisor.h>
#include <vrpipe/memory/memory_request.h>
#include <vrpipe/memory/sectors.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/screen_tiling.h>
#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

/// Which addresses the vertices and the attributes of warps are at: a functional model, the same at every fidelity.
///
/// A vertex warp reads its splats, and where they are drawn as triangles of their own these, in whole sectors. Shaded, it
/// writes the attributes of each triangle that primitive assembly will not cull: as on a GH100, where they come from
/// the PolyMorph engine, and none for culled ones. A fragment warp reads the first bytes of the attributes of each of its
/// quads' primitives once; one of a draw that reads the colour target instead, its quads there.
///
/// Attributes go round in a buffer of L2 (the Circular Buffer, paper 3.1). Who keeps them knows them by addresses that do
/// not come again; `in_buffer` is where such a one is.
class AttributeTraffic {
 public:
  // Of the lines and sectors of L1 and L2 (paper, table).
  static constexpr std::uint32_t line_bytes = 128;
  static constexpr std::uint32_t sector_bytes = 32;
  /// Attributes of a primitive.
  static constexpr std::uint32_t primitive_bytes = attribute_bytes_per_splat / 2;

  /// Sectors of a line, a bit each.
  struct LineSectors {
    std::uint64_t address = 0;  ///< of the line
    std::uint32_t sectors = 0;
  };
  /// What a fragment warp reads: attributes, by primitive, then by line; or colour, by line.
  struct FragmentReads {
    static constexpr unsigned lines_per_primitive = primitive_bytes / line_bytes + 2;
    MemoryTraffic traffic = MemoryTraffic::attribute;
    unsigned count = 0;
    std::array<LineSectors, quads_per_warp * lines_per_primitive> lines;
  };
  /// Requests of a vertex warp for what it reads are at most so many.
  static constexpr unsigned most_vertex_reads = 16;

  /// @param context  outlives it
  AttributeTraffic(const RenderContext& context, const AttributeFetch& fetch);

  /// Calls `access(MemoryRequest)` for each read before a vertex warp is shaded.
  template <class Access>
  void read_vertices(const VertexWarp& warp, Access&& access) const {
    const DrawCall& call = context_.draw(warp.draw);
    const std::uint64_t first = call.first + (warp.first_splat - call.base);
    const Region& region = regions_[warp.draw];
    const MemoryRequest request{0, 0, tlm::TLM_READ_COMMAND, origin(MemoryTraffic::vertex)};
    const std::uint64_t each = vertex_bytes_of_each(*call.geometry);
    in_sectors(region.splats + first * each, warp.splats * each, request, access);
    if (call.geometry->triangles.empty()) return;
    in_sectors(region.triangles + first * sizeof(ScreenTriangle), warp.splats * sizeof(ScreenTriangle), request,
               access);
  }

  /// And for each write after, in the order of addresses that are not in the buffer yet.
  template <class Access>
  void write_attributes(const VertexWarp& warp, Access&& access) const {
    const MemoryRequest request{0, 0, tlm::TLM_WRITE_COMMAND, origin(MemoryTraffic::attribute)};
    const std::uint32_t visible = visible_triangles(warp);
    const std::uint64_t base = attributes_ + std::uint64_t{warp.first_splat} * attribute_bytes_per_splat;
    for (unsigned i = 0; i < 2 * warp.splats;) {
      unsigned end = i;
      while (end < 2 * warp.splats && (visible >> end & 1U) != 0) ++end;
      in_sectors(base + i * primitive_bytes, (end - i) * primitive_bytes, request, access);
      i = end + 1;
    }
  }

  /// The same request where in memory it is.
  MemoryRequest in_buffer(MemoryRequest request) const {
    const auto [round, place] = buffer_bytes_.divide(request.address - attributes_);
    request.origin.round = static_cast<std::uint16_t>(round);
    request.address = attributes_ + place;
    return request;
  }
  /// For a run of sectors of a line of what a fragment warp reads, where in memory they are: attributes in the buffer.
  MemoryRequest read(MemoryTraffic traffic, std::uint64_t line, const SectorRun& run) const {
    const MemoryRequest request{line + std::uint64_t{run.first} * sector_bytes, run.count * sector_bytes,
                                tlm::TLM_READ_COMMAND, origin(traffic)};
    return traffic == MemoryTraffic::attribute ? in_buffer(request) : request;
  }
  /// Where in memory an attribute is.
  std::uint64_t in_buffer(std::uint64_t address) const {
    return attributes_ + buffer_bytes_.divide(address - attributes_).remainder;
  }
  /// What a fragment warp reads; attributes are not in the buffer yet.
  void find_reads(const Warp& warp, FragmentReads& reads) const;
  /// Of these reads.
  MemoryOrigin origin(MemoryTraffic traffic) const {
    return {traffic, static_cast<std::uint16_t>(context_.placement.gpc)};
  }

 private:
  /// Where the geometry of a draw is.
  struct Region {
    std::uint64_t splats = 0;
    std::uint64_t triangles = 0;
  };
  void read_attributes(const Warp& warp, FragmentReads& reads) const;
  void read_color(const Warp& warp, FragmentReads& reads) const;
  /// Of a warp's splats, two bits each, those that are not culled.
  std::uint32_t visible_triangles(const VertexWarp& warp) const;

  /// Accesses the sectors that bytes lie in, in naturally aligned pieces of up to a line.
  template <class Access>
  static void in_sectors(std::uint64_t address, std::uint64_t bytes, MemoryRequest request, Access&& access) {
    if (bytes == 0) return;
    const std::uint64_t end = (address + bytes + sector_bytes - 1) / sector_bytes * sector_bytes;
    request.address = address / sector_bytes * sector_bytes;
    for (; request.address < end; request.address += request.bytes) {
      request.bytes = line_bytes;
      while (request.address % request.bytes != 0 || request.bytes > end - request.address) request.bytes /= 2;
      access(static_cast<const MemoryRequest&>(request));
    }
  }

  const RenderContext& context_;
  const std::uint32_t attribute_bytes_;
  const Divisor buffer_bytes_;  ///< whole lines
  std::uint64_t attributes_;
  std::uint64_t color_;
  const std::uint32_t quad_bytes_;  ///< of the colour target
  const ScreenTiling tiling_;
  std::vector<Region> regions_;  ///< by draw
};

}  // namespace vrpipe
