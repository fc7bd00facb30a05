#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/gaussian_scene.h>

#include <cstdint>
#include <limits>

#include "workload_test_support.h"

namespace vrpipe {
namespace {

using testing::expect_user_error;

constexpr char kFormat[] = "ply\nformat binary_little_endian 1.0\n";

const std::vector<std::string> kRequired = {"x",       "y",       "z",       "f_dc_0", "f_dc_1", "f_dc_2", "opacity",
                                            "scale_0", "scale_1", "scale_2", "rot_0",  "rot_1",  "rot_2",  "rot_3"};

std::string header_of(const std::string& count, const std::vector<std::string>& properties) {
  std::string header = kFormat;
  header += "element vertex " + count + "\n";
  for (const std::string& property : properties) header += "property float " + property + "\n";
  return header + "end_header\n";
}

std::string floats(std::size_t count, float first = 1) {
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) {
    const float value = first + static_cast<float>(i);
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return bytes;
}

class GaussianPly : public testing::FolderTest {
 protected:
  /// The error of a file with these bytes names the file, and `parts`.
  void expect_refused(const std::string& bytes, std::vector<std::string> parts) {
    const auto path = write("scene.ply", bytes);
    parts.push_back("cannot read scene (" + path.string());
    expect_user_error([&] { read_gaussian_file(path); }, parts);
  }
};

TEST_F(GaussianPly, WritesAndReadsEveryAttributeBitForBitAtEveryDegree) {
  for (int degree = 0; degree <= 3; ++degree) {
    std::vector<GaussianAttributes> originals(3);
    float value = -7.25f;
    for (GaussianAttributes& g : originals) {
      for (auto* attribute : {&g.position, &g.log_scale, &g.f_dc}) {
        for (float& f : *attribute) f = (value += 0.37f);
      }
      for (float& f : g.rotation) f = (value += 0.37f);
      g.opacity_logit = (value += 0.37f);
      for (auto& channel : g.f_rest) {
        for (float& f : channel) f = (value += 0.37f);
      }
    }
    originals[1].opacity_logit = -std::numeric_limits<float>::infinity();
    write_gaussian_file(in_folder("scene.ply"), testing::scene_of(originals, degree));
    const GaussianScene scene = read_gaussian_file(in_folder("scene.ply")).gaussians;
    ASSERT_EQ(scene.size(), originals.size());
    EXPECT_EQ(scene.sh_degree(), degree);
    for (std::size_t i = 0; i < originals.size(); ++i) {
      EXPECT_EQ(scene[i].position(), originals[i].position);
      EXPECT_EQ(scene[i].log_scale(), originals[i].log_scale);
      EXPECT_EQ(scene[i].rotation(), originals[i].rotation);
      EXPECT_EQ(scene[i].opacity_logit(), originals[i].opacity_logit);
      EXPECT_EQ(scene[i].f_dc(), originals[i].f_dc);
      for (std::uint32_t channel = 0; channel < 3; ++channel) {
        for (std::uint32_t c = 1; c <= kShRestPerChannel[static_cast<std::size_t>(degree)]; ++c) {
          EXPECT_EQ(scene[i].f_rest(channel, c), originals[i].f_rest[channel][c - 1]);
        }
      }
    }
    EXPECT_EQ(files_in_folder(), 1u);
  }
}

TEST_F(GaussianPly, TheSceneOutlivesEveryCopyButTheLast) {
  write_gaussian_file(in_folder("scene.ply"), testing::scene_of({testing::ordinary_gaussian()}));
  GaussianScene copy;
  {
    const GaussianScene scene = read_gaussian_file(in_folder("scene.ply")).gaussians;
    copy = scene;
  }
  EXPECT_EQ(copy[0].position()[2], 5);
}

// L16: property order permuted, unknown properties of every type among them.
TEST_F(GaussianPly, PropertiesAreFoundByNameAndUnknownOnesOfAnyTypeSkipped) {
  std::string header = std::string(kFormat) + "comment made by hand\nobj_info nothing\nelement vertex 2\n";
  std::string record;
  std::vector<std::string> names(kRequired.rbegin(), kRequired.rend());
  const std::vector<std::pair<std::string, std::size_t>> types = {{"char", 1},   {"uchar", 1},  {"short", 2},
                                                                  {"ushort", 2}, {"int", 4},    {"uint", 4},
                                                                  {"float", 4},  {"double", 8}, {"int8", 1},
                                                                  {"uint8", 1},  {"int16", 2},  {"uint16", 2},
                                                                  {"int32", 4},  {"uint32", 4}, {"float32", 4},
                                                                  {"float64", 8}};
  for (std::size_t i = 0; i < names.size() || i < types.size(); ++i) {
    if (i < types.size()) {
      header += "property " + types[i].first + " extra_" + std::to_string(i) + "\n";
      record += std::string(types[i].second, '\x7f');
    }
    if (i < names.size()) {
      header += "property float32 " + names[i] + "\n";
      record += floats(1, static_cast<float>(i));
    }
  }
  const auto path = write("scene.ply", header + "end_header\n" + record + record);
  const GaussianScene scene = read_gaussian_file(path).gaussians;
  ASSERT_EQ(scene.size(), 2u);
  for (std::uint64_t i = 0; i < 2; ++i) {
    EXPECT_EQ(scene[i].position(), (std::array<float, 3>{13, 12, 11}));
    EXPECT_EQ(scene[i].f_dc(), (std::array<float, 3>{10, 9, 8}));
    EXPECT_EQ(scene[i].opacity_logit(), 7);
    EXPECT_EQ(scene[i].log_scale(), (std::array<float, 3>{6, 5, 4}));
    EXPECT_EQ(scene[i].rotation(), (std::array<float, 4>{3, 2, 1, 0}));
  }
}

TEST_F(GaussianPly, TrailingBytesOtherElementsAndCarriageReturnsAreTolerated) {
  const std::string body = floats(14);
  std::string header =
      "ply\r\nformat binary_little_endian 1.0\r\nelement camera 3\r\nproperty uchar id\r\nelement vertex 1\r\n";
  for (const std::string& name : kRequired) header += "property float " + name + "\r\n";
  header += "element face 7\r\nproperty list uchar int vertex_indices\r\nend_header\r\n";
  const GaussianScene scene =
      read_gaussian_file(write("scene.ply", header + "abc" + body + "trailing bytes")).gaussians;
  ASSERT_EQ(scene.size(), 1u);
  EXPECT_EQ(scene[0].position(), (std::array<float, 3>{1, 2, 3}));
  EXPECT_EQ(scene[0].rotation(), (std::array<float, 4>{11, 12, 13, 14}));
}

// L16, Z01: count 0.
TEST_F(GaussianPly, NoGaussiansIsAValidScene) {
  EXPECT_TRUE(read_gaussian_file(write("scene.ply", header_of("0", kRequired))).gaussians.empty());
}

TEST_F(GaussianPly, MissingFileIsNamed) {
  const auto path = in_folder("nowhere.ply");
  expect_user_error([&] { read_gaussian_file(path); }, {path.string(), "no such file", "check the path"});
}

TEST_F(GaussianPly, DirectoryIsRefused) {
  std::filesystem::create_directory(in_folder("scene.ply"));
  expect_user_error([&] { read_gaussian_file(in_folder("scene.ply")); }, {"it is a directory", "name a file in it"});
}

TEST_F(GaussianPly, EmptyFileIsRefused) { expect_refused("", {"the file is empty"}); }

TEST_F(GaussianPly, ForeignFileIsRefused) {
  expect_refused("PNG or whatever", {"does not begin with a line `ply`", "export the scene"});
  expect_refused("plymouth\n", {"does not begin with a line `ply`"});
}

TEST_F(GaussianPly, HeaderWithoutEndIsRefused) {
  expect_refused(std::string(kFormat) + "element vertex 1\n", {"no `end_header` line"});
  expect_refused("ply\n" + std::string(3u << 20, 'x'), {"no `end_header` line in its first 1048576 bytes"});
}

TEST_F(GaussianPly, AFormatThatIsNoneIsRefusedWithARemedy) {
  for (const std::string format : {"ascii 2.0", "binary_pdp_endian 1.0", "binary_little_endian 2.0"}) {
    std::string bytes = header_of("1", kRequired) + floats(14);
    bytes.replace(bytes.find("binary_little_endian 1.0"), 24, format);
    expect_refused(bytes,
                   {"its format is `" + format + "`", "convert it to `binary_little_endian 1.0`", "`ascii 1.0`"});
  }
}

TEST_F(GaussianPly, MalformedHeaderLinesAreRefused) {
  expect_refused("ply\nelement vertex 0\nend_header\n", {"no format line"});
  expect_refused(std::string(kFormat) + "element vertex -1\nend_header\n", {"header line 3", "element NAME COUNT"});
  expect_refused(std::string(kFormat) + "element vertex 99999999999999999999\nend_header\n", {"header line 3"});
  expect_refused(std::string(kFormat) + "element vertex 1 2\nend_header\n", {"header line 3"});
  expect_refused(std::string(kFormat) + "property float x\nend_header\n",
                 {"header line 3 is a property before any element"});
  expect_refused(std::string(kFormat) + "element vertex 1\nproperty float\nend_header\n",
                 {"header line 4", "property TYPE NAME"});
  expect_refused(std::string(kFormat) + "element vertex 1\nproperty half x\nend_header\n",
                 {"`x`", "unknown type `half`"});
  expect_refused(std::string(kFormat) + "verteces 1\nend_header\n", {"header line 3 begins with `verteces`"});
  expect_refused(std::string(kFormat) + "element chunk 0\nend_header\n", {"no element vertex"});
}

TEST_F(GaussianPly, MissingPropertyIsNamed) {
  for (const std::string& name : kRequired) {
    std::vector<std::string> others;
    for (const std::string& other : kRequired) {
      if (other != name) others.push_back(other);
    }
    // Without its third scale it is another model's (PlyKinds).
    if (name != "scale_2") expect_refused(header_of("1", others) + floats(13), {"no property `" + name + "`"});
  }
}

TEST_F(GaussianPly, CompressedPlyWithoutChunksIsRefusedAsSuch) {
  expect_refused(header_of("1", {"packed_position"}) + floats(1), {"no element chunk"});
}

TEST_F(GaussianPly, WrongTypeIsNamed) {
  std::string bytes = header_of("1", {"packed_position"}) + floats(40);
  std::string chunk = "element chunk 1\n";
  for (const char* axis : {"x", "y", "z"}) {
    chunk += std::string("property float min_") + axis + "\nproperty float max_" + axis + "\n";
    chunk += std::string("property double min_scale_") + axis + "\nproperty float max_scale_" + axis + "\n";
  }
  bytes.insert(bytes.find("element vertex"), chunk);
  expect_refused(bytes, {"property `min_scale_x` has type `double`", "convert it to float"});
}

TEST_F(GaussianPly, ListPropertyInVertexIsRefused) {
  std::string bytes = header_of("1", kRequired) + floats(14);
  bytes.insert(bytes.find("end_header"), "property list uchar int neighbours\n");
  expect_refused(bytes, {"element vertex has the list property `neighbours`"});
}

TEST_F(GaussianPly, ListBeforeVertexIsRefused) {
  std::string bytes = header_of("1", kRequired) + floats(14);
  bytes.insert(bytes.find("element vertex"), "element face 1\nproperty list uchar int corners\n");
  expect_refused(bytes, {"element face before element vertex", "`corners`", "write element vertex first"});
}

TEST_F(GaussianPly, RepeatedPropertyIsRefused) {
  std::vector<std::string> names = kRequired;
  names.push_back("x");
  expect_refused(header_of("1", names) + floats(15), {"property `x` occurs twice"});
}

TEST_F(GaussianPly, OddNumberOfShCoefficientsIsRefused) {
  std::vector<std::string> names = kRequired;
  for (int i = 0; i < 10; ++i) names.push_back("f_rest_" + std::to_string(i));
  expect_refused(header_of("1", names) + floats(24), {"10 properties f_rest_*", "0, 9, 24, 45 or 72"});
  names = kRequired;
  for (int i = 1; i < 10; ++i) names.push_back("f_rest_" + std::to_string(i));
  expect_refused(header_of("1", names) + floats(23), {"no property `f_rest_0`"});
}

TEST_F(GaussianPly, TruncatedFileNamesExpectedAndFoundBytes) {
  const std::string header = header_of("3", kRequired);
  const std::size_t needed = header.size() + 3 * 56;
  expect_refused(header + std::string(3 * 56 - 1, 'x'),
                 {"announces 3 records of 56 bytes", "needs " + std::to_string(needed) + " bytes",
                  "the file has " + std::to_string(needed - 1), "cut short"});
}

// L16: counts whose byte size overflows 32 and 64 bits.
TEST_F(GaussianPly, HugeCountsOverflowNothing) {
  for (const std::string count : {"2147483648", "4294967296", "9223372036854775808", "18446744073709551615"}) {
    expect_refused(header_of(count, kRequired) + floats(14), {"announces " + count + " records", "cut short"});
    std::string before = header_of("1", kRequired) + floats(14);
    before.insert(before.find("element vertex"), "element chunk " + count + "\nproperty double d\n");
    expect_refused(before, {"announces " + count + " records", "element chunk"});
  }
}

// A NUL once cut the message off, and a megabyte of name made one of it.
TEST_F(GaussianPly, ForeignNamesAreToldInPrintableTextOfModestLength) {
  const std::string nul("a\0b", 3);
  const auto twice = [](const std::string& name) {
    std::vector<std::string> names = kRequired;
    names.insert(names.end(), {name, name});
    return header_of("1", names) + floats(16);
  };
  expect_refused(twice(nul), {"property `a\\x00b` occurs twice in element vertex; export the scene"});
  expect_refused(twice("\x1b]0;title\a\xff"), {"`\\x1B]0;title\\x07\\xFF` occurs twice"});
  expect_refused(twice(std::string(5000, 'n')), {"`" + std::string(40, 'n') + "...` occurs twice"});
  std::string before = header_of("1", kRequired) + floats(14);
  before.insert(before.find("element vertex"), "element " + nul + " 9999\nproperty list uchar int \x1b[2J\n");
  expect_refused(before, {"element a\\x00b before", "`\\x1B[2J`; write element vertex first"});
}

TEST_F(GaussianPly, WritingIntoAMissingFolderSaysSoAndLeavesNothing) {
  const auto path = in_folder("nowhere/scene.ply");
  expect_user_error([&] { write_gaussian_file(path, GaussianScene()); },
                    {"cannot write scene", path.string(), "folder"});
  EXPECT_EQ(files_in_folder(), 0u);
}

TEST(RealScene, AScannedRobotLoads) {
  const testing::UnpackedFile robot("robot.ply");
  const GaussianScene scene = read_gaussian_file(robot.path()).gaussians;
  EXPECT_EQ(scene.size(), 125000u);
  EXPECT_EQ(scene.sh_degree(), 2);
}

TEST(RealScene, TrainFixtureWithIntegerAndForeignPropertiesLoads) {
  const GaussianScene scene = read_gaussian_file(testing::data_file("train_3_points.ply")).gaussians;
  EXPECT_EQ(scene.size(), 3u);
  EXPECT_EQ(scene.sh_degree(), 3);
}

}  // namespace
}  // namespace vrpipe
