#include <vrpipe/workloads/draw_list.h>

#include <cmath>
#include <limits>

#include "workload_test_support.h"

namespace vrpipe {
namespace {

using testing::expect_user_error;

Draw small_draw() {
  Draw draw;
  draw.width = 31;
  draw.height = 16384;
  for (int i = 0; i < 3; ++i) {
    const float f = static_cast<float>(i) + 0.3f;
    draw.splats.push_back({f, -f, 1e-42f, 2, -0.0f, 3.5f * f, 3.33f, 0, 7, 0.1f, 1e30f, 0.75f});
  }
  return draw;
}

std::string header(std::int32_t magic, std::int32_t count, std::int32_t width, std::int32_t height) {
  const std::int32_t fields[] = {magic, count, width, height};
  return std::string(reinterpret_cast<const char*>(fields), sizeof fields);
}

class DrawListFile : public testing::FolderTest {
 protected:
  void expect_refused(const std::string& bytes, std::vector<std::string> parts) {
    const auto path = write("draw.spl", bytes);
    parts.push_back(path.string());
    expect_user_error([&] { read_draw_list(path); }, parts);
  }
};

TEST_F(DrawListFile, RoundTripIsBitExact) {
  const Draw draw = small_draw();
  write_draw_list(in_folder("draw.spl"), draw);
  const DrawList list = read_draw_list(in_folder("draw.spl"));
  EXPECT_EQ(list.draw.width, draw.width);
  EXPECT_EQ(list.draw.height, draw.height);
  EXPECT_EQ(list.splats_in_file, 3u);
  EXPECT_EQ(list.dropped_not_finite, 0u);
  ASSERT_EQ(list.draw.splats.size(), draw.splats.size());
  EXPECT_EQ(std::memcmp(list.draw.splats.data(), draw.splats.data(), 3 * sizeof(Splat)), 0);
  EXPECT_EQ(files_in_folder(), 1u) << "no temporary file is left";
}

TEST_F(DrawListFile, BytesAreThoseOfTheContract) {
  write_draw_list(in_folder("draw.spl"), small_draw());
  const std::string bytes = testing::read_bytes(in_folder("draw.spl"));
  EXPECT_EQ(bytes.size(), 16u + 3 * 48);
  EXPECT_EQ(bytes.substr(0, 16), header(0x4c505331, 3, 31, 16384));
  EXPECT_EQ(bytes.substr(0, 4), "1SPL");
}

TEST_F(DrawListFile, HasNoDepthWhateverADrawOrAFileHoldsThere) {
  Draw draw = small_draw();
  write_draw_list(in_folder("without.spl"), draw);
  for (Splat& splat : draw.splats) splat.depth = 0.5f;
  write_draw_list(in_folder("draw.spl"), draw);
  const std::string bytes = testing::read_bytes(in_folder("draw.spl"));
  EXPECT_EQ(bytes, testing::read_bytes(in_folder("without.spl")));

  std::string strange = bytes;
  const float depth = 0.25f;
  std::memcpy(&strange[16 + 7 * 4], &depth, sizeof depth);
  const DrawList list = read_draw_list(write("strange.spl", strange));
  ASSERT_EQ(list.draw.splats.size(), 3u);
  EXPECT_EQ(list.draw.splats[0].depth, 0);
  EXPECT_EQ(list.dropped_not_finite, 0u);
}

TEST_F(DrawListFile, AMeshIsRefused) {
  Draw draw;
  draw.width = draw.height = 4;
  draw.mesh.resize(1);
  expect_user_error([&] { write_draw_list(in_folder("draw.spl"), draw); }, {"cannot write draw list", "splats only"});
}

TEST_F(DrawListFile, NoSplatsIsValid) {
  EXPECT_TRUE(read_draw_list(write("draw.spl", header(kDrawListMagic, 0, 4, 4))).draw.splats.empty());
}

TEST_F(DrawListFile, NonFiniteSplatsAreDroppedAndCounted) {
  Draw draw = small_draw();
  draw.splats[0].bx = std::numeric_limits<float>::infinity();
  draw.splats[2].opacity = std::nanf("");
  write_draw_list(in_folder("draw.spl"), draw);
  const DrawList list = read_draw_list(in_folder("draw.spl"));
  EXPECT_EQ(list.splats_in_file, 3u);
  EXPECT_EQ(list.dropped_not_finite, 2u);
  ASSERT_EQ(list.draw.splats.size(), 1u);
  EXPECT_EQ(list.draw.splats[0].cx, draw.splats[1].cx);
}

TEST_F(DrawListFile, ForeignAndShortFilesAreRefused) {
  expect_refused("", {"empty"});
  expect_refused("1S", {"magic number"});
  expect_refused("something else entirely", {"magic number", "--save-draw"});
  expect_refused(header(kDrawListMagic, 1, 4, 4).substr(0, 11), {"needs 16 bytes", "has 11"});
  expect_refused(header(kDrawListMagic, 2, 4, 4) + std::string(95, '\0'),
                 {"2 splats need 112 bytes", "has 111", "cut short"});
  expect_refused(header(kDrawListMagic, 2147483647, 4, 4), {"2147483647 splats need 103079215072 bytes"});
  expect_refused(header(kDrawListMagic, -1, 4, 4), {"-1 splats"});
}

TEST_F(DrawListFile, ImageSizeOutOfRangeIsRefused) {
  expect_refused(header(kDrawListMagic, 0, 0, 4), {"0x4", "1 to 16384"});
  expect_refused(header(kDrawListMagic, 0, 4, 16385), {"4x16385", "1 to 16384"});
  expect_refused(header(kDrawListMagic, 0, -4, 4), {"-4x4"});
}

TEST_F(DrawListFile, AFailedWriteLeavesWhatWasThere) {
  write_draw_list(in_folder("draw.spl"), small_draw());
  const std::string before = testing::read_bytes(in_folder("draw.spl"));
  Draw draw = small_draw();
  draw.triangles.resize(draw.splats.size());
  expect_user_error([&] { write_draw_list(in_folder("draw.spl"), draw); }, {"triangles", "splats only"});
  draw = small_draw();
  draw.width = 0;
  expect_user_error([&] { write_draw_list(in_folder("draw.spl"), draw); }, {"1 to 16384"});
  EXPECT_EQ(testing::read_bytes(in_folder("draw.spl")), before);
  EXPECT_EQ(files_in_folder(), 1u);
  expect_user_error([&] { write_draw_list(in_folder("none/draw.spl"), small_draw()); },
                    {"cannot write draw list", "none/draw.spl"});
  write_draw_list("/dev/null", small_draw());
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

}  // namespace
}  // namespace vrpipe
