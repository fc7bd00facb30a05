// The kinds of .ply in which people's programs write Gaussians, each against the plain one.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/workloads/camera.h>
#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/preprocess.h>
#include <vrpipe/workloads/scene_description.h>

#include "../workloads/workload_test_support.h"

namespace vrpipe {
namespace {

using testing::expect_user_error;

/// A .ply of one element `vertex`, under construction.
struct MadePly {
  std::vector<std::pair<std::string, std::string>> properties;  ///< type and name
  std::vector<std::vector<double>> records;
  std::vector<std::string> comments;

  std::size_t place(const std::string& name) const {
    for (std::size_t i = 0; i < properties.size(); ++i) {
      if (properties[i].second == name) return i;
    }
    throw std::out_of_range(name);
  }
  void retype(const std::string& type, const std::vector<std::string>& names) {
    for (const std::string& name : names) properties[place(name)].first = type;
  }
  void add(const std::string& type, const std::string& name, double value) {
    properties.emplace_back(type, name);
    for (auto& record : records) record.push_back(value);
  }
  void drop(const std::string& name) {
    const auto at = static_cast<std::ptrdiff_t>(place(name));
    properties.erase(properties.begin() + at);
    for (auto& record : records) record.erase(record.begin() + at);
  }

  std::string header(const std::string& format) const {
    std::string text = "ply\nformat " + format + " 1.0\n";
    for (const std::string& comment : comments) text += "comment " + comment + "\n";
    text += fmt::format("element vertex {}\n", records.size());
    for (const auto& [type, name] : properties) text += "property " + type + " " + name + "\n";
    return text + "end_header\n";
  }
  template <class Number>
  static void append(std::string& bytes, double value, bool swap) {
    const auto number = static_cast<Number>(value);
    char raw[sizeof number];
    std::memcpy(raw, &number, sizeof number);
    if (swap) std::reverse(raw, raw + sizeof number);
    bytes.append(raw, sizeof number);
  }
  std::string binary(bool big_endian = false) const {
    std::string bytes = header(big_endian ? "binary_big_endian" : "binary_little_endian");
    for (const auto& record : records) {
      for (std::size_t i = 0; i < record.size(); ++i) {
        if (properties[i].first == "double") append<double>(bytes, record[i], big_endian);
        if (properties[i].first == "float") append<float>(bytes, record[i], big_endian);
        if (properties[i].first == "uchar") append<std::uint8_t>(bytes, record[i], big_endian);
        if (properties[i].first == "short") append<std::int16_t>(bytes, record[i], big_endian);
      }
    }
    return bytes;
  }
  std::string ascii() const {
    std::string bytes = header("ascii");
    for (const auto& record : records) {
      for (std::size_t i = 0; i < record.size(); ++i) {
        bytes += properties[i].first == "float" ? fmt::format("{} ", static_cast<float>(record[i]))
                                                : fmt::format("{} ", record[i]);
      }
      bytes += "\n";
    }
    return bytes;
  }
};

constexpr std::size_t gaussians = 60;

/// Before the camera at (0, 0, -3), as INRIA's files have them; of float32.
MadePly plain(std::size_t rest = 0) {
  MadePly ply;
  const auto value = [](std::size_t i, std::uint64_t k) {
    return static_cast<double>(static_cast<float>(static_cast<double>(mix(mix(7) ^ (100 * i + k)) >> 11U) * 0x1p-53));
  };
  for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"}) ply.properties.emplace_back("float", name);
  for (std::size_t i = 0; i < rest; ++i) ply.properties.emplace_back("float", "f_rest_" + std::to_string(i));
  for (const char* name : {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
    ply.properties.emplace_back("float", name);
  for (std::size_t i = 0; i < gaussians; ++i) {
    auto& record = ply.records.emplace_back();
    for (std::size_t k = 0; k < ply.properties.size(); ++k) {
      const std::string& name = ply.properties[k].second;
      const double share = value(i, k);
      record.push_back(static_cast<double>(static_cast<float>(name.size() == 1              ? 2 * share - 1
                                                              : name.rfind("scale", 0) == 0 ? -4 + 2 * share
                                                                                            : 3 * share - 1)));
    }
  }
  return ply;
}

class PlyKinds : public testing::FolderTest {
 protected:
  GaussianFile read(const std::string& bytes) const { return read_gaussian_file(write("a.ply", bytes).string()); }
  void refused(const std::string& bytes, const std::vector<std::string>& parts) const {
    expect_user_error([&] { read(bytes); }, parts);
  }
};

void expect_same(const GaussianScene& a, const GaussianScene& b) {
  ASSERT_EQ(a.size(), b.size());
  ASSERT_EQ(a.sh_degree(), b.sh_degree());
  const std::uint32_t per_channel = kShRestPerChannel[static_cast<std::size_t>(a.sh_degree())];
  for (std::uint64_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].position(), b[i].position()) << i;
    ASSERT_EQ(a[i].log_scale(), b[i].log_scale()) << i;
    ASSERT_EQ(a[i].rotation(), b[i].rotation()) << i;
    ASSERT_EQ(a[i].opacity_logit(), b[i].opacity_logit()) << i;
    ASSERT_EQ(a[i].f_dc(), b[i].f_dc()) << i;
    for (std::uint32_t channel = 0; channel < 3; ++channel) {
      for (std::uint32_t c = 1; c <= per_channel; ++c) ASSERT_EQ(a[i].f_rest(channel, c), b[i].f_rest(channel, c)) << i;
    }
  }
}

Draw drawn(const GaussianScene& scene, const Vec3& at) {
  SceneSummary summary;
  return preprocess(scene, look_at(at + Vec3(0, 0, -3), at, {0, -1, 0}, 50, 320, 240), {}, summary);
}

TEST_F(PlyKinds, AsciiAndBigEndianAreTheLittleEndianBitForBit) {
  for (const std::size_t rest : {0U, 9U, 45U}) {
    const MadePly ply = plain(rest);
    const GaussianFile expected = read(ply.binary());
    expect_same(read(ply.binary(true)).gaussians, expected.gaussians);
    expect_same(read(ply.ascii()).gaussians, expected.gaussians);
    EXPECT_TRUE(expected.notes.empty());
  }
}

TEST_F(PlyKinds, NumbersOfAnyTypeAreTaken) {
  const MadePly ply = plain();
  MadePly other = ply;
  other.retype("double", {"opacity", "rot_1", "scale_2", "f_dc_0"});
  other.add("short", "nx", -3);
  for (const std::string& bytes : {other.binary(), other.binary(true), other.ascii()})
    expect_same(read(bytes).gaussians, read(ply.binary()).gaussians);
}

TEST_F(PlyKinds, PositionsInDoubleKeepTheirPlacesFarFromTheOrigin) {
  const Vec3 far(500000, 4000000, 117);
  MadePly ply = plain();
  const Draw expected = drawn(read(ply.binary()).gaussians, {});
  ASSERT_GT(expected.splats.size(), gaussians / 2);
  ply.retype("double", {"x", "y", "z"});
  for (auto& record : ply.records) {
    for (std::size_t axis = 0; axis < 3; ++axis) record[axis] += far[axis];
  }
  for (const std::string& bytes : {ply.binary(), ply.binary(true), ply.ascii()}) {
    const GaussianFile file = read(bytes);
    EXPECT_TRUE(file.notes.empty());
    const Draw draw = drawn(file.gaussians, far);
    ASSERT_EQ(draw.splats.size(), expected.splats.size());
    for (std::size_t i = 0; i < draw.splats.size(); ++i) {
      EXPECT_NEAR(draw.splats[i].cx, expected.splats[i].cx, 1e-3) << i;
      EXPECT_NEAR(draw.splats[i].cy, expected.splats[i].cy, 1e-3) << i;
      EXPECT_NEAR(draw.splats[i].ax, expected.splats[i].ax, 1e-3) << i;
    }
    const SceneDescription described = describe(file.gaussians);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(described.low[axis], far[axis] - 1, 0.1);
      EXPECT_NEAR(described.high[axis], far[axis] + 1, 0.1);
    }
  }
  // Written, they are world positions again, in single precision.
  write_gaussian_file(in_folder("b.ply"), read(ply.binary()).gaussians);
  const GaussianFile written = read_gaussian_file(in_folder("b.ply").string());
  for (std::size_t i = 0; i < gaussians; ++i)
    EXPECT_EQ(written.gaussians[i].position()[1], static_cast<float>(ply.records[i][1])) << i;
}

TEST_F(PlyKinds, SinglePrecisionThatHasMovedSplatsIsSaid) {
  MadePly ply = plain();
  for (auto& record : ply.records) record[1] += 4000000;
  const GaussianFile file = read(ply.binary());
  ASSERT_EQ(file.notes.size(), 1U);
  EXPECT_NE(file.notes[0].find("steps of up to 0.25"), std::string::npos) << file.notes[0];
  EXPECT_NE(file.notes[0].find("100 % of the Gaussians"), std::string::npos) << file.notes[0];
  ply = plain();
  for (auto& record : ply.records) record[1] += 1000;  // steps of 6e-5
  EXPECT_TRUE(read(ply.binary()).notes.empty());
}

TEST_F(PlyKinds, CommentsSayWhatIsUp) {
  const std::vector<std::pair<std::string, Vec3>> comments{{"Vertical Axis: z", {0, 0, 1}},
                                                           {"vertical axis: Y", {0, 1, 0}},
                                                           {"Vertical axis: 0 0 1", {0, 0, 1}},
                                                           {"Vertical axis: 0 -1 0", {0, -1, 0}},
                                                           {"Vertical axis: 0.6 0.8 0", {0.6, 0.8, 0}},
                                                           {"Vertical axis: up", {0, -1, 0}},
                                                           {"Vertical axis: 0 0 0", {0, -1, 0}},
                                                           {"made by hand", {0, -1, 0}}};
  for (const auto& [comment, up] : comments) {
    MadePly ply = plain();
    ply.comments = {"first", comment};
    EXPECT_EQ(read(ply.binary()).up, up) << comment;
  }
}

TEST_F(PlyKinds, OfDegree4TheFirstThreeAreUsed) {
  const MadePly ply = plain(72);
  const GaussianFile file = read(ply.binary());
  ASSERT_EQ(file.gaussians.sh_degree(), 3);
  EXPECT_EQ(file.notes, (std::vector<std::string>{"spherical harmonics of degree 4 are left out"}));
  for (std::size_t i = 0; i < gaussians; ++i) {
    for (std::uint32_t channel = 0; channel < 3; ++channel) {
      for (std::uint32_t c = 1; c <= 15; ++c)
        EXPECT_EQ(file.gaussians[i].f_rest(channel, c), static_cast<float>(ply.records[i][6 + 24 * channel + c - 1]));
    }
  }
  refused(plain(48).binary(), {"48 properties f_rest_*", "0, 9, 24, 45 or 72"});
}

TEST_F(PlyKinds, ColoursMayBeBytes) {
  MadePly ply = plain();
  for (const char* name : {"f_dc_0", "f_dc_1", "f_dc_2"}) ply.drop(name);
  ply.add("uchar", "red", 255);
  ply.add("uchar", "green", 0);
  ply.add("uchar", "blue", 51);
  const GaussianFile file = read(ply.binary());
  constexpr double band_0 = 0.28209479177387814;
  for (const double expected : {1.0, 0.0, 0.2}) {
    const std::size_t channel = expected == 1.0 ? 0 : expected == 0.0 ? 1 : 2;
    EXPECT_NEAR(0.5 + band_0 * static_cast<double>(file.gaussians[3].f_dc()[channel]), expected, 1e-6);
  }
}

TEST_F(PlyKinds, MipSplattingsFilterIsPutIntoScalesAndOpacity) {
  MadePly ply = plain();
  ply.add("float", "filter_3D", 0.05);
  const GaussianFile file = read(ply.binary());
  ASSERT_EQ(file.notes.size(), 1U);
  EXPECT_NE(file.notes[0].find("filter_3D"), std::string::npos);
  for (std::size_t i = 0; i < gaussians; ++i) {
    long double ratio = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      const long double scale = std::exp(static_cast<long double>(ply.records[i][ply.place("scale_0") + k]));
      const long double fused = std::sqrt(scale * scale + 0.05L * 0.05L);
      ratio *= scale / fused;
      EXPECT_NEAR(std::exp(static_cast<double>(file.gaussians[i].log_scale()[k])), static_cast<double>(fused), 1e-6);
    }
    const long double opacity = 1 / (1 + std::exp(-static_cast<long double>(ply.records[i][ply.place("opacity")])));
    EXPECT_NEAR(sigmoid(static_cast<double>(file.gaussians[i].opacity_logit())), static_cast<double>(opacity * ratio),
                1e-6);
  }
}

TEST_F(PlyKinds, OtherModelsAreNamed) {
  for (const auto& [name, parts] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"motion_0", {"dynamic scene", "`motion_0`", "one moment"}},
           {"trbf_center", {"dynamic scene", "`trbf_center`"}},
           {"f_offset_0", {"Scaffold-GS", "`f_offset_0`"}}}) {
    MadePly ply = plain();
    ply.add("float", name, 0);
    refused(ply.binary(), parts);
  }
  MadePly ply = plain();
  ply.drop("scale_2");
  refused(ply.binary(), {"2D Gaussian splatting", "two scales"});
}

TEST_F(PlyKinds, ValuesThatLookActivatedAreSaid) {
  MadePly ply = plain();
  for (auto& record : ply.records) {
    record[ply.place("opacity")] = 0.7;
    for (std::size_t k = 0; k < 3; ++k) record[ply.place("scale_0") + k] = 0.03;
  }
  ASSERT_EQ(read(ply.binary()).notes.size(), 1U);
  EXPECT_NE(read(ply.binary()).notes[0].find("not logits and logarithms"), std::string::npos);
  ply.records[5][ply.place("scale_1")] = -3;
  EXPECT_TRUE(read(ply.binary()).notes.empty());
}

TEST_F(PlyKinds, DamagedTextIsRefusedAtItsByte) {
  const std::string good = plain().ascii();
  const std::size_t data = good.find("end_header\n") + 11;
  const std::string last = good.substr(0, good.rfind(' ', good.size() - 4));
  refused(last, {"at byte ", "it ends", "`rot_3` of record 59", "a number (float)"});
  std::string bad = good;
  bad.replace(data, 1, "q");
  refused(bad, {fmt::format("at byte {} is `q", data), "`x` of record 0 of element vertex"});
  bad = good;
  bad.replace(bad.find("vertex 60"), 9, "vertex 99999999999999");
  refused(bad, {"announces 99999999999999 records"});
  MadePly bytes = plain();
  bytes.add("uchar", "red", 7);
  std::string text = bytes.ascii();
  EXPECT_EQ(read(text).gaussians.size(), gaussians);
  text.replace(text.rfind(" 7 "), 3, " 7.0 ");
  EXPECT_EQ(read(text).gaussians.size(), gaussians) << "a whole number, written as some programs do";
  text.replace(text.rfind(" 7.0 "), 5, " 256 ");
  refused(text, {"`256`", "`red` of record 59", "(uchar)"});
  // Elements before the vertices, one of them without properties.
  text = good;
  text.insert(text.find("element vertex"), "element nothing 18446744073709551615\nelement camera 2\nproperty int id\n");
  text.insert(text.find("end_header\n") + 11, "1\n2\n");
  EXPECT_EQ(read(text).gaussians.size(), gaussians);
  // Numbers beyond a float's range, and those that are none.
  text = good;
  text.replace(data, good.find(' ', data) - data, "1e999");
  EXPECT_EQ(read(text).gaussians[0].position()[0], std::numeric_limits<float>::infinity());
  text.replace(data, 5, "+nan");
  EXPECT_TRUE(std::isnan(read(text).gaussians[0].position()[0]));
}

/// As PlayCanvas writes it: of one chunk, whose scales begin at minus infinity.
TEST_F(PlyKinds, ACompressedChunkWithAScaleOfZeroLosesNoGaussian) {
  const float infinity = std::numeric_limits<float>::infinity();
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement chunk 1\n";
  for (const char* axes : {"x", "y", "z"})
    bytes += std::string("property float min_") + axes + "\nproperty float max_" + axes + "\n";
  for (const char* axes : {"x", "y", "z"})
    bytes += std::string("property float min_scale_") + axes + "\nproperty float max_scale_" + axes + "\n";
  bytes +=
      "element vertex 3\nproperty uint packed_position\nproperty uint packed_rotation\nproperty uint packed_scale\n"
      "property uint packed_color\nend_header\n";
  const auto add = [&](auto value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(raw, sizeof value);
  };
  for (int axis = 0; axis < 3; ++axis) {
    add(-1.0F);
    add(1.0F);
  }
  for (int axis = 0; axis < 3; ++axis) {
    add(axis == 2 ? -infinity : -3.0F);
    add(-2.0F);
  }
  for (const std::uint32_t scale : {0U, 0x3ffU, 0x7ffU}) {  // of z: at the low end, between, at the high end
    add(std::uint32_t{0x80000000U});
    add(std::uint32_t{0x1ff7fdffU});
    add(scale);
    add(std::uint32_t{0xff8040c0U});
  }
  const GaussianFile file = read(bytes);
  ASSERT_EQ(file.gaussians.size(), 3U);
  EXPECT_EQ(file.gaussians[0].log_scale()[2], -infinity);
  EXPECT_EQ(file.gaussians[1].log_scale()[2], -infinity);
  EXPECT_EQ(file.gaussians[2].log_scale()[2], -2.0F);
  for (std::uint64_t i = 0; i < 3; ++i) EXPECT_EQ(rejection_of(file.gaussians[i], 0), Rejection::none) << i;
}

TEST_F(PlyKinds, PropertiesThatAreNotUsedAreNamed) {
  MadePly ply = plain();
  for (const char* name : {"nx", "red", "alpha"}) ply.add("float", name, 0);
  EXPECT_TRUE(read(ply.binary()).notes.empty());
  ply.add("uchar", "segment", 3);
  ply.add("float", "confidence", 1);
  EXPECT_EQ(read(ply.binary()).notes,
            (std::vector<std::string>{"properties of its vertices are not used: confidence, segment"}));
  for (int i = 0; i < 9; ++i) ply.add("float", "p" + std::to_string(i), 0);
  EXPECT_EQ(read(ply.binary()).notes[0],
            "properties of its vertices are not used: confidence, p0, p1, p2, p3, p4, p5, p6 and 3 more");
}

}  // namespace
}  // namespace vrpipe
