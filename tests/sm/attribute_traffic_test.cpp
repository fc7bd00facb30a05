// Which addresses vertex and fragment warps touch.
#include "sm/attribute_traffic.h"

#include <limits>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "sm/sm_parameters.h"
#include "vpo/vpo.h"

#include "support/builders.h"

namespace vrpipe {
namespace {

using testing::draw_of;
using testing::flat_box;

/// Splats that all can be seen.
std::vector<Splat> boxes(std::uint32_t count) { return std::vector<Splat>(count, flat_box(8, 8, 24, 24, 0.5F)); }

/// By the default parameters.
AttributeFetch usual_fetch() { return SmTime(SmParameters(), DevicePrecision()).fetch; }

struct Requests {
  std::vector<MemoryRequest> all;
  std::uint64_t bytes = 0;
  std::uint64_t begin = ~std::uint64_t{0};
  std::uint64_t end = 0;
  std::map<std::uint64_t, unsigned> sectors;  ///< how often each is touched

  void operator()(const MemoryRequest& request) {
    EXPECT_EQ(request.bytes & (request.bytes - 1), 0U);
    EXPECT_EQ(request.address % request.bytes, 0U) << "naturally aligned";
    EXPECT_GE(request.bytes, 32U);
    EXPECT_LE(request.bytes, 128U);
    all.push_back(request);
    bytes += request.bytes;
    begin = std::min(begin, request.address);
    end = std::max(end, request.address + request.bytes);
    for (std::uint64_t sector = request.address; sector < request.address + request.bytes; sector += 32) {
      ++sectors[sector];
    }
  }
};
Requests reads_of(const AttributeTraffic& traffic, const VertexWarp& warp) {
  Requests requests;
  traffic.read_vertices(warp, requests);
  return requests;
}
Requests writes_of(const AttributeTraffic& traffic, const VertexWarp& warp) {
  Requests requests;
  traffic.write_attributes(warp, requests);
  return requests;
}

TEST(AttributeTraffic, AVertexWarpReadsItsSplatsLineByLine) {
  const Draw draw = draw_of(64, 64, boxes(24));
  const RenderContext context = testing::context_of(draw);
  const AttributeTraffic traffic(context, usual_fetch());
  const AddressMap map = address_map(*context.frame, context.format);
  for (std::uint32_t first = 0; first < 24; first += 8) {
    const Requests reads = reads_of(traffic, {first, 8});
    ASSERT_EQ(reads.all.size(), 3U) << "8 x 48 bytes";
    EXPECT_EQ(reads.begin, map.vertices.address + 48 * first);
    EXPECT_EQ(reads.end, reads.begin + 384);
    for (const MemoryRequest& request : reads.all) {
      EXPECT_EQ(request.command, tlm::TLM_READ_COMMAND);
      EXPECT_EQ(request.origin.traffic, MemoryTraffic::vertex);
    }
  }
}

TEST(AttributeTraffic, AVertexWarpThatBeginsInASectorReadsAllOfIt) {
  const Draw draw = draw_of(64, 64, boxes(24));
  const RenderContext context = testing::context_of(draw);
  const AttributeTraffic traffic(context, usual_fetch());
  const std::uint64_t vertices = address_map(*context.frame, context.format).vertices.address;
  // Bytes 240 to 479 of the splats.
  const Requests reads = reads_of(traffic, {5, 5});
  EXPECT_EQ(reads.begin, vertices + 224);
  EXPECT_EQ(reads.end, vertices + 480);
  EXPECT_EQ(reads.bytes, 256U) << "each sector once";
}

TEST(AttributeTraffic, AGeometryIsReadWhereItIsHoweverOftenItIsDrawn) {
  const auto first = testing::geometry_of(64, 64, boxes(16));
  const auto second = testing::geometry_of(64, 64, boxes(8));
  Frame frame(64, 64);
  frame.draw(first, {});
  frame.draw(second, {});
  frame.draw(first, {}, "", 8, 8);
  const RenderContext context = testing::context_of(frame);
  const AttributeTraffic traffic(context, usual_fetch());
  const AddressMap map = address_map(frame, context.format);
  const auto vertices = [&](std::uint32_t splat, DrawIndex draw) {
    return reads_of(traffic, {splat, 8, draw}).begin - map.vertices.address;
  };
  EXPECT_EQ(vertices(0, 0), 0U);
  EXPECT_EQ(vertices(16, 1), 16U * 48);
  EXPECT_EQ(vertices(24, 2), 8U * 48) << "the same as those of the first draw";
  EXPECT_EQ(writes_of(traffic, {24, 8, 2}).begin, map.attributes.address + 24 * 704) << "its own";
}

TEST(AttributeTraffic, TrianglesOfTheirOwnAreReadAsWell) {
  Draw draw = draw_of(64, 64, boxes(16));
  draw.triangles.assign(16, testing::one_quad_triangle(10, 10));
  const RenderContext context = testing::context_of(draw);
  const AttributeTraffic traffic(context, usual_fetch());
  const AddressMap map = address_map(*context.frame, context.format);
  const Requests reads = reads_of(traffic, {8, 8});
  EXPECT_EQ(reads.bytes, 8U * 48 + 8 * 24);
  EXPECT_EQ(reads.begin, map.vertices.address + 8 * 48);
  EXPECT_EQ(reads.end, map.primitives.address + 16 * 24);
  EXPECT_EQ(writes_of(traffic, {8, 1}).bytes, 352U) << "one triangle";
}

TEST(AttributeTraffic, AMeshIsReadByTrianglesOf120Bytes) {
  Draw draw = draw_of(64, 64);
  draw.mesh.resize(24);
  for (MeshTriangle& triangle : draw.mesh) {
    const float x[] = {10, 10, 40};
    const float y[] = {10, 40, 10};
    for (unsigned i = 0; i < 3; ++i) triangle.vertices[i] = {x[i], y[i], 0.5F, 1, 1, 1, 1, 0, 0, 1};
  }
  DrawState state;
  state.shader = FragmentShader::lit;
  const RenderContext context = testing::context_of(draw, state);
  const AttributeTraffic traffic(context, usual_fetch());
  const AddressMap map = address_map(*context.frame, context.format);
  EXPECT_EQ(map.vertices.bytes, 24U * 120);
  const Requests reads = reads_of(traffic, {8, 8});
  EXPECT_EQ(reads.begin, map.vertices.address + 8 * 120);
  EXPECT_EQ(reads.bytes, 8U * 120);
  EXPECT_LE(reads.all.size(), std::size_t{AttributeTraffic::most_vertex_reads});
  EXPECT_EQ(writes_of(traffic, {8, 1}).bytes, 352U) << "one triangle";
}

TEST(AttributeTraffic, AVertexWarpWrites704BytesASplat) {
  const Draw draw = draw_of(64, 64, boxes(16));
  const RenderContext context = testing::context_of(draw);
  const AttributeTraffic traffic(context, usual_fetch());
  const std::uint64_t attributes = address_map(*context.frame, context.format).attributes.address;
  const Requests writes = writes_of(traffic, {8, 8});
  EXPECT_EQ(writes.all.size(), 44U) << "whole lines";
  EXPECT_EQ(writes.bytes, 8U * 704);
  EXPECT_EQ(writes.begin, attributes + 8 * 704);
  EXPECT_EQ(writes.end, attributes + 16 * 704);
  for (const MemoryRequest& request : writes.all) {
    EXPECT_EQ(request.command, tlm::TLM_WRITE_COMMAND);
    EXPECT_EQ(request.origin.traffic, MemoryTraffic::attribute);
  }
}

// The paper's circular buffer: what comes later is written over what came first.
TEST(AttributeTraffic, AttributesGoRoundInTheirBuffer) {
  const Draw draw = draw_of(64, 64, boxes(32));
  const RenderContext context = testing::context_of(draw);
  AttributeFetch fetch = usual_fetch();
  fetch.buffer_bytes = 16 * 704;
  const AttributeTraffic traffic(context, fetch);
  const std::uint64_t attributes = address_map(*context.frame, context.format).attributes.address;
  const auto writes_in_buffer = [&](const VertexWarp& warp) {
    Requests requests;
    for (const MemoryRequest& request : writes_of(traffic, warp).all) requests(traffic.in_buffer(request));
    return requests;
  };
  for (const std::uint32_t splat : {0U, 16U}) {
    const Requests writes = writes_in_buffer({splat, 8});
    EXPECT_EQ(writes.begin, attributes);
    EXPECT_EQ(writes.end, attributes + 8 * 704);
  }
  // A warp at the end goes on at the beginning.
  const Requests across = writes_in_buffer({12, 8});
  EXPECT_EQ(across.bytes, 8U * 704);
  EXPECT_EQ(across.begin, attributes);
  EXPECT_EQ(across.end, attributes + 16 * 704);
  EXPECT_EQ(traffic.in_buffer(attributes + 17 * 704 + 32), attributes + 704 + 32);
  // Who reads says which round it means.
  for (const std::uint64_t round : {0U, 1U, 5U}) {
    const MemoryRequest read = traffic.read(MemoryTraffic::attribute, attributes + (round * 16 + 2) * 704, {1, 2});
    EXPECT_EQ(read.address, attributes + 2 * 704 + 32);
    EXPECT_EQ(read.bytes, 64U);
    EXPECT_EQ(read.origin.round, round);
  }
}

TEST(AttributeTraffic, OfWhatIsCulledNothingIsWritten) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<Splat> splats = boxes(8);
  splats[1] = flat_box(200, 200, 220, 220, 0.5F);      // off the screen
  splats[3].red = nan;                                 // not finite
  splats[4] = flat_box(8.1F, 8.1F, 8.2F, 8.2F, 0.5F);  // between samples
  splats[6].cx = 1e9F;                                 // beyond the guard band
  const Draw draw = draw_of(64, 64, splats);
  const RenderContext context = testing::context_of(draw);
  const AttributeTraffic traffic(context, usual_fetch());
  const std::uint64_t attributes = address_map(*context.frame, context.format).attributes.address;
  const Requests writes = writes_of(traffic, {0, 8});
  EXPECT_EQ(writes.bytes, 4U * 704);
  for (const std::uint64_t splat : {1U, 3U, 4U, 6U}) {
    EXPECT_EQ(writes.sectors.count(attributes + splat * 704), 0U) << splat;
    EXPECT_EQ(writes.sectors.count(attributes + splat * 704 + 352), 0U) << splat;
  }
  EXPECT_EQ(reads_of(traffic, {0, 8}).bytes, 8U * 48) << "that is known once they are read";
}

/// Against primitive assembly itself.
TEST(AttributeTraffic, WritesTheHalfOfEachPrimitiveThatIsAssembledOnce) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Draw draw = testing::random_draw(96, 64, 300, seed);
    const RenderContext context = testing::context_of(draw);
    const AttributeTraffic traffic(context, usual_fetch());
    const std::uint64_t attributes = address_map(*context.frame, context.format).attributes.address;
    PrimitiveAssembly vpo(PrimitiveAssembly::Parameters(), context);
    std::set<std::uint64_t> expected;
    Requests writes;
    for (std::uint32_t first = 0; first < 300; first += 8) {
      const VertexWarp warp{first, std::min(8U, 300 - first)};
      traffic.write_attributes(warp, writes);
      for (std::uint32_t splat = first; splat < first + warp.splats; ++splat) {
        std::array<Primitive, 2> out;
        const unsigned count = vpo.assemble(0, splat, out);
        for (unsigned i = 0; i < count; ++i) {
          for (unsigned byte = 0; byte < 352; byte += 32) {
            expected.insert(attributes + std::uint64_t{out[i].splat} * 704 + out[i].triangle * 352U + byte);
          }
        }
      }
    }
    std::set<std::uint64_t> written;
    for (const auto& [sector, times] : writes.sectors) {
      written.insert(sector);
      ASSERT_EQ(times, 1U) << seed;
    }
    ASSERT_EQ(written, expected) << seed;
    ASSERT_LT(expected.size(), 300U * 22) << "some are culled";
  }
}

Warp warp_of(const std::vector<std::pair<std::uint32_t, unsigned>>& primitives) {
  Warp warp;
  for (const auto& [splat, triangle] : primitives) {
    warp.quads[warp.count] = {splat, warp.count, all_lanes, static_cast<std::uint16_t>(triangle & 1U), 0};
    ++warp.count;
  }
  return warp;
}

TEST(AttributeTraffic, AFragmentWarpReadsEachPrimitiveOnce) {
  const Draw draw = draw_of(64, 64, boxes(16));
  const RenderContext context = testing::context_of(draw);
  const AttributeTraffic traffic(context, usual_fetch());
  const std::uint64_t attributes = address_map(*context.frame, context.format).attributes.address;
  AttributeTraffic::FragmentReads reads;
  traffic.find_reads(warp_of({{3, 0}, {3, 0}, {4, 0}, {3, 0}, {4, 0}, {4, 1}, {3, 0}, {4, 1}}), reads);
  // 40 bytes lie in two sectors. Splat 3 begins at byte 2112 = 16 x 128 + 64; splat 4 at 2816 = 22 x 128; its second
  // triangle at 3168 = 24 x 128 + 96, in the last sector of a line.
  ASSERT_EQ(reads.count, 4U);
  EXPECT_EQ(reads.lines[0].address, attributes + 2048);
  EXPECT_EQ(reads.lines[0].sectors, 0b1100U);
  EXPECT_EQ(reads.lines[1].address, attributes + 2816);
  EXPECT_EQ(reads.lines[1].sectors, 0b0011U);
  EXPECT_EQ(reads.lines[2].address, attributes + 3072);
  EXPECT_EQ(reads.lines[2].sectors, 0b1000U);
  EXPECT_EQ(reads.lines[3].address, attributes + 3200);
  EXPECT_EQ(reads.lines[3].sectors, 0b0001U);
}

TEST(AttributeTraffic, ReadsTheSectorsOfAsManyBytesAsTheShaderWants) {
  const Draw draw = draw_of(64, 64, boxes(16));
  const RenderContext context = testing::context_of(draw);
  const std::uint64_t attributes = address_map(*context.frame, context.format).attributes.address;
  for (std::uint32_t bytes = 4; bytes <= 352; bytes += 4) {
    AttributeFetch fetch = usual_fetch();
    fetch.attribute_bytes = bytes;
    const AttributeTraffic traffic(context, fetch);
    AttributeTraffic::FragmentReads reads;
    std::vector<std::pair<std::uint32_t, unsigned>> primitives;
    std::set<std::uint64_t> expected;
    for (std::uint32_t i = 0; i < 8; ++i) {
      primitives.emplace_back(i, i % 3 % 2);
      for (std::uint32_t byte = 0; byte < bytes; byte += 4) {
        expected.insert((attributes + std::uint64_t{704} * i + 352U * primitives.back().second + byte) / 32);
      }
    }
    traffic.find_reads(warp_of(primitives), reads);
    std::set<std::uint64_t> read;
    for (unsigned i = 0; i < reads.count; ++i) {
      ASSERT_EQ(reads.lines[i].address % 128, 0U);
      ASSERT_NE(reads.lines[i].sectors, 0U);
      for (unsigned sector = 0; sector < 4; ++sector) {
        if ((reads.lines[i].sectors >> sector & 1U) == 0) continue;
        ASSERT_TRUE(read.insert(reads.lines[i].address / 32 + sector).second);
      }
      ASSERT_EQ(reads.lines[i].sectors >> 4U, 0U);
    }
    ASSERT_EQ(read, expected) << bytes;
  }
}

// Colour is at 0, a quad after the other in Morton order: of RGBA16F four quads of 4x4 pixels are a line.
TEST(AttributeTraffic, AFragmentWarpThatReadsColourReadsItsQuadsAndNoAttributes) {
  Frame frame(64, 64);
  frame.draw(testing::geometry_of(64, 64, boxes(2)), testing::alpha_threshold_state());
  const RenderContext context = testing::context_of(frame);
  const AttributeTraffic traffic(context, usual_fetch());
  Warp warp;
  warp.tile = {1, 0};
  for (const unsigned position : {0U, 9U, 2U, 1U, 63U})
    warp.quads[warp.count++] = {0, static_cast<std::uint8_t>(position), all_lanes, 0, 0};
  AttributeTraffic::FragmentReads reads;
  traffic.find_reads(warp, reads);
  EXPECT_TRUE(reads.traffic == MemoryTraffic::color);
  ASSERT_EQ(reads.count, 3U);
  const std::uint64_t tile = 16 * 128;
  EXPECT_EQ(reads.lines[0].address, tile);
  EXPECT_EQ(reads.lines[0].sectors, 0b1011U);
  EXPECT_EQ(reads.lines[1].address, tile + 128);
  EXPECT_EQ(reads.lines[1].sectors, 0b0001U);
  EXPECT_EQ(reads.lines[2].address, tile + std::uint64_t{15} * 128);
  EXPECT_EQ(reads.lines[2].sectors, 0b1000U);
  const MemoryRequest request = traffic.read(reads.traffic, reads.lines[0].address, {0, 2});
  EXPECT_EQ(request.address, tile);
  EXPECT_EQ(request.bytes, 64U);
  EXPECT_TRUE(request.origin.traffic == MemoryTraffic::color);
}

}  // namespace
}  // namespace vrpipe
