// Files that lie, are cut short, or are made to do harm.
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include <vrpipe/workloads/gaussian_file.h>

#include "formats/scene_format.h"
#include "fuzz/exercise.h"
#include "workloads/workload_test_support.h"

namespace vrpipe {
namespace {

namespace fs = std::filesystem;
using testing::data_file;
using testing::exercise;
using testing::expect_user_error;
using testing::read_bytes;

SceneFile scene_file(const std::string& name, const std::string& bytes) {
  SceneFile file;
  file.name = name;
  file.bytes = FileBytes::copy(bytes.data(), bytes.size(), name);
  file.neighbour = [](const std::string&) -> FileBytes {
    throw UserError(kCannotReadScene, "x", "no such file", "check the path");
  };
  return file;
}

/// All that a file says of its Gaussians, bit by bit.
std::string bits_of(const GaussianScene& scene) {
  std::string bits;
  const auto append = [&bits](const auto& values) {
    bits.append(reinterpret_cast<const char*>(values.data()), sizeof values);
  };
  for (std::uint64_t i = 0; i < scene.size(); ++i) {
    const GaussianRef gaussian = scene[i];
    append(gaussian.position());
    append(gaussian.log_scale());
    append(gaussian.rotation());
    append(gaussian.f_dc());
    append(std::array<float, 1>{gaussian.opacity_logit()});
    for (std::uint32_t c = 1; c <= kShRestPerChannel[static_cast<std::size_t>(scene.sh_degree())]; ++c) {
      append(std::array<float, 3>{gaussian.f_rest(0, c), gaussian.f_rest(1, c), gaussian.f_rest(2, c)});
    }
  }
  return bits;
}

/// Sanitizers take ten times as long; there every fifth cut has to do.
#ifdef VRPIPE_SANITIZED
constexpr std::size_t kCutStep = 5;
#else
constexpr std::size_t kCutStep = 1;
#endif

/// Whether a message says where in a file something is wrong.
bool names_a_place(const std::string& message) {
  if (message.find("does not begin with") != std::string::npos) return true;
  return message.find("byte") != std::string::npos && message.find('\n') == std::string::npos &&
         message.find_first_of("0123456789") != std::string::npos;
}

/// The files of a folder of tests/data/formats, below it too, that a test is about.
std::vector<fs::path> files_below(const fs::path& folder, const std::vector<std::string>& extensions) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    for (const std::string& extension : extensions) {
      if (entry.is_regular_file() && entry.path().extension() == extension) files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(CutFiles, AreRefusedAtEveryByte) {
  std::vector<fs::path> files = files_below(data_file("formats"), {".ply", ".splat", ".spz", ".ksplat", ".sog"});
  files.push_back(data_file("train_3_points.ply"));
  ASSERT_GT(files.size(), 35U);
  for (const fs::path& path : files) {
    const std::string bytes = read_bytes(path), name = path.filename().string();
    const std::uint64_t count = read_scene(scene_file(name, bytes)).gaussians.size();
    ASSERT_GT(count, 0U) << name;
    for (std::size_t size = 1; size < bytes.size(); size += kCutStep) {
      // A .splat has no header to say how many Gaussians there are: cut behind a record it is a smaller scene.
      const bool is_whole = path.extension() == ".splat" && size % 32 == 0;
      try {
        const std::uint64_t got = read_scene(scene_file(name, bytes.substr(0, size))).gaussians.size();
        ASSERT_TRUE(is_whole) << name << " cut to " << size << " bytes gives " << got << " Gaussians of " << count;
        ASSERT_EQ(got, size / 32);
      } catch (const UserError& error) {
        ASSERT_FALSE(is_whole) << error.what();
        ASSERT_TRUE(names_a_place(error.what())) << name << " cut to " << size << " bytes: " << error.what();
      }
    }
  }
}

/// A folder of SOG in which one file can be another one.
struct FolderScene {
  explicit FolderScene(const fs::path& folder) {
    for (const fs::path& path : files_below(folder, {".json", ".webp"})) {
      files[path.lexically_relative(folder).string()] = read_bytes(path);
    }
  }
  SceneFile open(const std::string& name) const {
    SceneFile file = scene_file(name, files.at(name));
    file.neighbour = [this](const std::string& other) {
      const auto found = files.find(other);
      if (found == files.end()) throw UserError(kCannotReadScene, other, "no such file", "check the path");
      return FileBytes::copy(found->second.data(), found->second.size(), other);
    };
    return file;
  }
  std::map<std::string, std::string> files;
};

/// Cut anywhere, a file of the folder is refused, or nothing that counts is missing: the last byte of an image may be filling.
void expect_cuts_found(const FolderScene& whole, const std::string& index, const std::string& lod = {},
                       const std::string& within = {}) {
  const auto bits = [&](const FolderScene& scene) {
    SceneFile file = scene.open(index);
    if (!lod.empty()) file.choices["lod"] = lod;
    return bits_of(read_scene(file).gaussians);
  };
  const std::string expected = bits(whole);
  const auto is_used = [&](const std::string& name) {
    FolderScene without = whole;
    without.files[name].clear();
    try {
      bits(without);
      return false;
    } catch (const UserError&) {
      return true;
    }
  };
  for (const auto& [name, bytes] : whole.files) {
    if (name.compare(0, within.size(), within) != 0) continue;
    EXPECT_TRUE(is_used(name)) << name;
    FolderScene cut = whole;
    std::size_t survived = 0;
    for (std::size_t size = 0; size < bytes.size(); size += kCutStep) {
      cut.files[name] = bytes.substr(0, size);
      try {
        ASSERT_EQ(bits(cut), expected) << name << " cut to " << size << " bytes";
        ++survived;
      } catch (const UserError& error) {
        ASSERT_TRUE(names_a_place(error.what())) << name << " cut to " << size << " bytes: " << error.what();
      }
    }
    EXPECT_LE(survived, 2U) << name;
  }
}

TEST(CutFiles, OfAFolderAreRefusedAtEveryByte) {
  expect_cuts_found(FolderScene(data_file("formats/sog")), "meta.json");
}

TEST(CutFiles, OfAStreamedFolderAreRefusedAtEveryByte) {
  const FolderScene scene(data_file("formats/streamed"));
  ASSERT_EQ(scene.files.size(), 33U);
  for (const char* within : {"lod-meta.json", "L_0/", "L_0b/", "environment/"}) {
    expect_cuts_found(scene, "lod-meta.json", "0", within);
  }
  expect_cuts_found(scene, "lod-meta.json", "1", "L_1/");
}

/// All that was ever found by a fuzzer or thought out, and its smallest inputs.
TEST(HostileFiles, OfTheCorpusDoNoHarm) {
  const std::map<std::string, std::string> formats = {{"inria_ply", "INRIA .ply"},
                                                      {"compressed_ply", "PlayCanvas compressed .ply"},
                                                      {"splat", "antimatter15 .splat"},
                                                      {"spz", "Niantic .spz"},
                                                      {"ksplat", "mkkellogg .ksplat"},
                                                      {"sog", "PlayCanvas SOG"},
                                                      {"streamed_sog", "PlayCanvas streamed SOG"}};
  const fs::path corpus = data_file("../fuzz/corpus");
  for (const auto& format : formats) {
    std::size_t files = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(corpus / format.first)) {
      const std::string bytes = read_bytes(entry.path());
      EXPECT_NO_THROW(exercise(format.second, bytes.data(), bytes.size())) << entry.path();
      EXPECT_NO_THROW(exercise("any", bytes.data(), bytes.size())) << entry.path();
      ++files;
    }
    EXPECT_GT(files, 0U) << format.first;
  }
}

/// What comes of a file in a process that may have some megabytes of memory more than it has now: the error's message. What is
/// announced by those of these tests would take gigabytes.
std::string in_little_memory(const std::function<std::string()>& read) {
  int ends[2];
  if (::pipe(ends) != 0) return "no pipe";
  const pid_t child = ::fork();
  if (child == 0) {
    std::string message;
    try {
#ifndef VRPIPE_SANITIZED
      std::uint64_t pages = 0;
      std::ifstream("/proc/self/statm") >> pages;
      const rlim_t most = pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) + (std::uint64_t{128} << 20U);
      const struct rlimit limit { most, most };
      ::setrlimit(RLIMIT_AS, &limit);
#endif
      message = read();
    } catch (const UserError& error) {
      message = error.what();
    } catch (const std::exception& error) {
      message = std::string("not a user's error: ") + error.what();
    }
    ::close(ends[0]);
    const ssize_t written = ::write(ends[1], message.data(), message.size());
    ::_exit(written == static_cast<ssize_t>(message.size()) ? 0 : 1);
  }
  ::close(ends[1]);
  std::string message;
  char buffer[4096];
  for (ssize_t got = 0; (got = ::read(ends[0], buffer, sizeof buffer)) > 0;)
    message.append(buffer, static_cast<std::size_t>(got));
  ::close(ends[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0 ? message : "it ended the program: " + std::to_string(status);
}

/// Checks that bytes are refused for the reason given, and not for want of memory.
void expect_refused(const std::string& name, const std::string& bytes, const std::vector<std::string>& parts) {
  const std::string message = in_little_memory([&] {
    read_scene(scene_file(name, bytes));
    return std::string();
  });
  EXPECT_EQ(message.find("memory"), std::string::npos) << message;
  EXPECT_LT(message.size(), 600U) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  for (const std::string& part : parts)
    EXPECT_NE(message.find(part), std::string::npos) << "`" << part << "` is not in: " << message;
}

std::string attack(const std::string& name) { return read_bytes(data_file("../fuzz/corpus/" + name)); }

/// `bytes` with a little-endian number in it.
template <class T>
std::string with(std::string bytes, std::size_t offset, const T& value) {
  return bytes.replace(offset, sizeof value, std::string(reinterpret_cast<const char*>(&value), sizeof value));
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::invalid_argument("no " + from);
  return text.replace(at, from.size(), to);
}

TEST(LyingHeaders, OfPlyTakeNoMemory) {
  const std::string ply = read_bytes(data_file("formats/sh1.ply"));
  for (const char* count : {"18446744073709551615", "9223372036854775808", "4294967296", "25"}) {
    const std::string lie = replaced(ply, "vertex 24", std::string("vertex ") + count);
    expect_refused("a.ply", lie,
                   {std::string("announces ") + count + " records of 104 bytes in element vertex",
                    "bytes, and the file has 31"});
  }
  expect_refused("a.ply", replaced(ply, "vertex 24", "vertex 18446744073709551616"), {"header line 3", "2^64-1"});
  expect_refused("a.ply", replaced(ply, "vertex 24", "vertex -1"), {"header line 3"});
  // Elements before it whose sizes sum to 2^64.
  const std::string before =
      "element a 9223372036854775808\nproperty char x\nelement b 9223372036854775808\nproperty char x\n";
  expect_refused("a.ply", replaced(ply, "element vertex", before + "element vertex"),
                 {"9223372036854775808 records of 1 bytes in element a"});
  // Records of nothing: as many as one likes, at no cost.
  const std::string nothing = replaced(ply, "element vertex", "element a 18446744073709551615\nelement vertex");
  EXPECT_EQ(read_scene(scene_file("a.ply", nothing)).gaussians.size(), 24U);

  const std::string compressed = read_bytes(data_file("formats/sh1.compressed.ply"));
  expect_refused("a.ply", replaced(compressed, "vertex 24", "vertex 18446744073709551615"),
                 {"announces 18446744073709551615 records", "element vertex"});
  expect_refused("a.ply", replaced(compressed, "chunk 1\n", "chunk 18446744073709551615\n"),
                 {"announces 18446744073709551615 records", "element chunk"});
  expect_refused("a.ply", replaced(compressed, "chunk 1\n", "chunk 0\n"), {"24 vertices need 1 chunks"});
  expect_refused("a.ply", replaced(compressed, "sh 24", "sh 18446744073709551615"),
                 {"announces 18446744073709551615 records", "element sh"});
  expect_refused("a.ply", replaced(compressed, "sh 24", "sh 23"), {"23 records for 24"});
}

TEST(LyingHeaders, OfSpzTakeNoMemory) {
  const std::string bare = read_bytes(data_file("formats/v3_bare_sh3.spz"));
  expect_refused("a.spz", with(bare, 8, 0xffffffffU), {"announces 4294967295 Gaussians in 1576 bytes"});
  expect_refused("a.spz", with(bare, 8, 60000U), {"60000 records of 9 bytes", "the file has 1576"});
  expect_refused("a.spz", with(bare, 12, std::uint8_t{4}), {"at byte 12", "SH degree is 4"});
  expect_refused("a.spz", with(bare, 13, std::uint8_t{24}), {"at byte 13", "24 fractional bits"});
  expect_refused("a.spz", attack("spz/bomb"), {"gzip stream goes on", "bytes of its Gaussians"});
  const std::string v4 = read_bytes(data_file("formats/v4.spz"));
  expect_refused("a.spz", with(v4, 8, 0xffffffffU), {"announces 4294967295 Gaussians"});
  expect_refused("a.spz", with(v4, 16, 0xffffffffU), {"table of streams", "from byte 4294967295"});
  expect_refused("a.spz", with(v4, 32, ~std::uint64_t{0}), {"its positions", "18446744073709551615 bytes"});
  expect_refused("a.spz", with(v4, 40, ~std::uint64_t{0}), {"at byte 40", "18446744073709551615", "216 are needed"});
  expect_refused("a.spz", attack("spz/v4_announces_exabytes"), {"at byte 112", "no Zstandard frame of 27 bytes"});
}

TEST(LyingHeaders, OfKsplatTakeNoMemory) {
  const std::string file = read_bytes(data_file("formats/level1_sh0.ksplat"));
  const auto header = [&](std::size_t offset, std::uint32_t value) { return with(file, 4096 + offset, value); };
  expect_refused("a.ksplat", with(file, 4, 0xffffffffU), {"headers of its sections", "4294967295 records of 1024"});
  expect_refused("a.ksplat", header(0, 0xffffffffU), {"4294967295 Gaussians and room for 24"});
  expect_refused("a.ksplat", with(header(0, 0xffffffffU), 4100, 0xffffffffU), {"buckets hold 24 of its 4294967295"});
  expect_refused("a.ksplat", header(12, 0xffffffffU), {"centres of a section's buckets", "4294967295 records"});
  expect_refused("a.ksplat", header(32, 0xffffffffU), {"buckets hold"});
  expect_refused("a.ksplat", header(36, 0xffffffffU), {"sizes of a section's buckets", "4294967295 records"});
  expect_refused("a.ksplat", header(8, 0), {"buckets hold 8 of its 24"});
  expect_refused("a.ksplat", header(20, 0xffff), {"65535"});
}

TEST(LyingHeaders, OfSogTakeNoMemory) {
  const FolderScene scene(data_file("formats/sog"));
  const auto refused = [&](const std::string& from, const std::string& to, const std::vector<std::string>& parts) {
    FolderScene lie = scene;
    lie.files["meta.json"] = replaced(lie.files["meta.json"], from, to);
    const std::string message = in_little_memory([&] {
      read_scene(lie.open("meta.json"));
      return std::string();
    });
    EXPECT_EQ(message.find("memory"), std::string::npos) << message;
    for (const std::string& part : parts)
      EXPECT_NE(message.find(part), std::string::npos) << "`" << part << "` is not in: " << message;
  };
  refused("\"count\":24", "\"count\":9007199254740992", {"announces 9007199254740992 Gaussians"});
  refused("\"count\":24", "\"count\":18446744073709551615", {"`count` is not a count"});
  refused("\"count\":24", "\"count\":184467440737095516150", {"`count` is not a count"});
  refused("\"count\":24", "\"count\":-1", {"`count` is not a count"});
  refused("\"count\":24", "\"count\":1e999", {"out of range"});
  refused("\"count\":24", "\"count\":26", {"5x5 pixels", "26 to"});
  refused("\"count\":70", "\"count\":65537", {"palette has up to 65536"});
  refused("\"count\":70", "\"count\":65536", {"512x2 pixels", "524288 to"});
}

TEST(LyingHeaders, OfZipArchivesTakeNoMemory) {
  expect_refused("a.sog", attack("sog/zip_bomb"), {"means_l.webp", "to have 8388608 bytes", "the archive has"});
  expect_refused("a.sog", attack("sog/zip_announces_gigabytes"), {"means_l.webp", "4294967294 bytes"});
  expect_refused("a.sog", attack("sog/zip_lzma"), {"meta.json", "neither stored nor deflated"});
  expect_refused("a.sog", attack("sog/zip_lzma").substr(0, 30), {"ends at byte 30, without the directory"});
  expect_refused("a.sog", "hello", {"at byte 0", "no zip archive"});
}

TEST(LyingHeaders, OfImagesTakeNoMemory) {
  const std::string message = in_little_memory([] {
    const std::string bytes = attack("sog/webp_bomb");
    return exercise("PlayCanvas SOG", bytes.data(), bytes.size());
  });
  EXPECT_NE(message.find("its image has 16383x16383 pixels, and 3 to"), std::string::npos) << message;
}

TEST(LyingHeaders, EqualGaussiansInFewBytesAreRead) {
  // A constant image is small whatever its size; as many Gaussians as this are little to ask for.
  const std::string bytes = attack("sog/constant_images");
  ASSERT_LT(bytes.size(), 4096U);
  SceneFile file = testing::hostile_file("PlayCanvas SOG", bytes.data(), bytes.size());
  file.name = "meta.json";
  EXPECT_EQ(read_scene(file).gaussians.size(), 65536U);
}

TEST(LyingHeaders, ImagesThatAreNamedOftenCountOnce) {
  // One large file for all images: it justifies the Gaussians of one.
  FolderScene scene(data_file("formats/sog"));
  scene.files.at("means_l.webp").append(100000, '\0');
  std::string& meta = scene.files.at("meta.json");
  meta = replaced(meta, "\"count\":24", "\"count\":200000");
  for (const char* name : {"means_u.webp", "scales.webp", "quats.webp", "sh0.webp"})
    meta = replaced(meta, name, "means_l.webp");
  expect_user_error([&] { read_scene(scene.open("meta.json")); }, {"announces 200000 Gaussians in 101", "bytes"});
}

/// A streamed scene of one level, whose regions lie in these files.
std::string lod_meta(const std::vector<std::string>& files, const std::string& environment = "null") {
  std::string names, leaves;
  for (std::size_t i = 0; i < files.size(); ++i) {
    names += (i > 0 ? ",\"" : "\"") + files[i] + "\"";
    leaves +=
        std::string(i > 0 ? "," : "") + R"({"lods":{"0":{"file":)" + std::to_string(i) + R"(,"offset":0,"count":4}}})";
  }
  return R"({"lodLevels":1,"environment":)" + environment + R"(,"filenames":[)" + names + R"(],"tree":{"children":[)" +
         leaves + "]}}";
}

TEST(LyingHeaders, AStreamedSceneHasItsGaussiansOnce) {
  FolderScene scene(data_file("formats/streamed"));
  const auto refused = [&](const std::string& meta, const std::vector<std::string>& parts) {
    scene.files["lod-meta.json"] = meta;
    expect_user_error([&] { read_scene(scene.open("lod-meta.json")); }, parts);
  };
  refused(lod_meta(std::vector<std::string>(100000, "L_0/meta.json")), {"`filenames` has `L_0/meta.json` twice"});
  refused(lod_meta({"L_0/meta.json", "L_1/.././L_0//meta.json"}), {"twice"});
  const std::string leaf = R"({"lods":{"0":{"file":0,"offset":0,"count":16}}})";
  refused(R"({"lodLevels":1,"filenames":["L_0/meta.json"],"tree":{"children":[)" + leaf + "," + leaf + "]}}",
          {"a region has Gaussians 0 to 16 of file 0, which has 16"});
  const auto run = [&](const std::string& offset, const std::string& count) {
    return R"({"lodLevels":1,"filenames":["L_0/meta.json"],"tree":{"lods":{"0":{"file":0,"offset":)" + offset +
           R"(,"count":)" + count + "}}}}";
  };
  refused(run("0", "17"), {"0 to 17", "which has 16"});
  refused(run("17", "0"), {"17 to 17", "which has 16"});
  refused(run("9007199254740992", "9007199254740992"), {"which has 16"});
  refused(run("18446744073709551615", "1"), {"`offset` is not a count"});
  refused(replaced(run("0", "1"), "\"file\":0", "\"file\":1"), {"file 1 of 1"});
}

TEST(LyingHeaders, ScenesThatShareImagesAreNotMoreThanTheirBytes) {
  // A scene of 65536 equal Gaussians takes a kilobyte: a thousand such that name the same images would take gigabytes.
  const std::string bytes = attack("sog/constant_images");
  const SceneFile constant = testing::hostile_file("PlayCanvas SOG", bytes.data(), bytes.size());
  const std::string meta(reinterpret_cast<const char*>(constant.bytes.data()), constant.bytes.size());
  FolderScene scene(data_file("formats/sog"));
  std::vector<std::string> names;
  for (int i = 0; i < 1000; ++i) {
    names.push_back(std::to_string(i) + ".json");
    scene.files[names.back()] = meta;
  }
  for (const char* name : {"means_l.webp", "means_u.webp", "scales.webp", "quats.webp", "sh0.webp"}) {
    const FileBytes image = constant.neighbour(name);
    scene.files[name] = std::string(reinterpret_cast<const char*>(image.data()), image.size());
  }
  scene.files["lod-meta.json"] = replaced(lod_meta(names), "\"count\":4", "\"count\":65536");
  for (int i = 1; i < 1000; ++i) {
    scene.files["lod-meta.json"] = replaced(scene.files["lod-meta.json"], "\"count\":4}", "\"count\":65536}");
  }
  const std::string message = in_little_memory([&] {
    read_scene(scene.open("lod-meta.json"));
    return std::string();
  });
  EXPECT_NE(message.find("announces 65536000 Gaussians"), std::string::npos) << message;
}

/// Each of these takes a moment, or days if what is read again and again grows with what is read.
TEST(TarPits, AreReadInAMoment) {
  std::string ply = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n";
  for (int i = 0; i < 30000; ++i) ply += "property float p" + std::to_string(i) + "\n";
  expect_refused("a.ply", ply + "end_header\n" + std::string(120000, '\0'), {"has no property `x`"});
  ply = "ply\nformat binary_little_endian 1.0\n";
  for (int i = 0; i < 60000; ++i) ply += "element a 1\n";
  expect_refused("a.ply", ply + "end_header\n", {"no element vertex"});
  ply = "ply\nformat";
  for (int i = 0; i < 100000; ++i) ply += " " + std::to_string(i);
  expect_refused("a.ply", ply + "\nend_header\n", {"its format is `0 1 2 3", "..."});
  expect_refused("a.ply", "ply\ncomment " + std::string(std::size_t{4} << 20U, 'x'), {"`end_header`"});

  expect_refused("meta.json", std::string(1000000, '['), {"at byte 1000001", "no JSON"});
  expect_user_error([] { read_scene(scene_file("meta.json", std::string(std::size_t{65} << 20U, ' '))); },
                    {"its JSON has 68157440 bytes", "up to 64 MiB"});
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "{\"children\":[";
  deep += "{}";
  for (int i = 0; i < 100000; ++i) deep += "]}";
  expect_refused("lod-meta.json", R"({"lodLevels":1,"filenames":[],"tree":)" + deep + "}x", {"no JSON"});
  EXPECT_EQ(
      read_scene(scene_file("lod-meta.json", R"({"lodLevels":1,"filenames":[],"tree":)" + deep + "}")).gaussians.size(),
      0U);
}

/// A zip archive of this many empty files.
std::string many_files(unsigned files) {
  const auto number = [](std::uint32_t value, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i));
    return text;
  };
  std::string entries, directory;
  for (unsigned i = 0; i < files; ++i) {
    const std::string name = std::to_string(i) + "/meta.json";
    const std::string fields = number(10, 2) + std::string(20, '\0') +
                               number(static_cast<std::uint32_t>(name.size()), 2) + std::string(2, '\0');
    directory += "PK\x01\x02" + number(10, 2) + fields + std::string(10, '\0') +
                 number(static_cast<std::uint32_t>(entries.size()), 4) + name;
    entries += "PK\x03\x04" + fields + name;
  }
  return entries + directory + "PK\x05\x06" + std::string(4, '\0') + number(files, 2) + number(files, 2) +
         number(static_cast<std::uint32_t>(directory.size()), 4) +
         number(static_cast<std::uint32_t>(entries.size()), 4) + std::string(2, '\0');
}

TEST(TarPits, ArchivesOfManyFilesAreReadInAMoment) {
  expect_refused("a.sog", many_files(65535), {"0/meta.json", "no JSON"});
}

TEST(TarPits, NamesThatCollideInAHashAreNoMoreThanOthers) {
  // Names of 8 bytes whose hashes in libstdc++ differ by multiples of a table's size are easy to find; a tree does not care.
  std::map<std::size_t, std::string> by_bucket;
  std::string properties;
  constexpr std::size_t kTable = 62233;  // a prime that libstdc++ grows to
  int found = 0;
  for (std::uint64_t i = 0; found < 2000 && i < 4000000; ++i) {
    const std::string name = "p" + std::to_string(i);
    if (std::hash<std::string>()(name) % kTable >= 100) continue;
    properties += "property uchar " + name + "\n";
    ++found;
  }
  ASSERT_GT(found, 1000);
  const std::string ply = read_bytes(data_file("formats/sh0.ply"));
  const std::string wide = replaced(replaced(ply, "vertex 260", "vertex 1"), "end_header", properties + "end_header");
  EXPECT_EQ(read_scene(scene_file("a.ply", wide)).gaussians.size(), 1U);
}

class HostileFolders : public testing::FolderTest {
 protected:
  HostileFolders() { fs::copy(data_file("formats/sog"), in_folder(""), fs::copy_options::recursive); }
  /// What is said when meta.json names this file for an image.
  void expect_refused_name(const std::string& name, const std::vector<std::string>& parts) const {
    write("meta.json", replaced(read_bytes(data_file("formats/sog/meta.json")), "means_l.webp", name));
    const std::string folder = in_folder("").string();
    expect_user_error([&] { read_gaussian_file(folder); }, parts);
    try {
      read_gaussian_file(folder);
    } catch (const UserError& error) {
      EXPECT_LT(std::string(error.what()).size(), 1200U);
    }
  }
};

TEST_F(HostileFolders, NamesDoNotLeadOutOfTheFolder) {
  for (const char* name :
       {"../means_l.webp", "/etc/passwd", "a/../../means_l.webp", "..", "", "means_l.webp\\u0000", "\\u0000"}) {
    expect_refused_name(name, {"meta.json", "it names the file `", "lie in its folder"});
  }
  expect_refused_name(std::string(100000, 'x'), {"it names the file `xxx", "lie in its folder"});
  expect_refused_name(std::string(999, 'x'), {"File name too long"});
  expect_refused_name("missing.webp", {"missing.webp", "no such file"});
  expect_refused_name(".", {"directory"});
  expect_refused_name("meta.json", {"meta.json", "at byte 0", "neither a lossless WebP image nor a .png"});
  expect_refused_name("means_l.webp/", {"means_l.webp"});
}

TEST_F(HostileFolders, WhatIsNoFileIsRefusedAtOnce) {
  ASSERT_EQ(::mkfifo(in_folder("pipe").c_str(), 0600), 0);
  expect_refused_name("pipe", {"pipe", "not a regular file"});
  fs::create_directory(in_folder("folder"));
  expect_refused_name("folder", {"folder", "directory"});
  fs::create_symlink("loop", in_folder("loop"));
  expect_refused_name("loop", {"loop", "symbolic links"});
  fs::create_symlink("/dev/zero", in_folder("zero"));
  expect_refused_name("zero", {"zero", "not a regular file"});
  write("nothing", "");
  expect_refused_name("nothing", {"nothing", "the file is empty"});
  std::ofstream(in_folder("huge")).close();
  fs::resize_file(in_folder("huge"), std::uintmax_t{1} << 42U);
#ifndef VRPIPE_SANITIZED  // an allocator that ends the program
  const std::string message = in_little_memory([&] {
    expect_refused_name("huge", {"huge", "it needs 4194304 MiB of memory"});
    return std::string();
  });
  EXPECT_EQ(message, "");
#endif
}

/// Reads again and again while someone writes, until that was noticed a few times: an error each time, or the file as it was.
TEST(ChangingFiles, AreAnErrorNotACrash) {
  class Folder : public testing::FolderTest {
   public:
    void TestBody() override {}
    using FolderTest::in_folder;
    using FolderTest::write;
  };
  const Folder folder;
  const std::string whole(std::size_t{9} << 20U, 'x');
  const fs::path path = folder.write("a.splat", whole);
  std::atomic<bool> done{false};
  std::thread writer([&] {
    while (!done) {
      fs::resize_file(path, whole.size() / 2);
      folder.write("a.splat", whole);
    }
  });
  int shorter = 0, written = 0;
  while (shorter + written < 20) {
    try {
      const FileBytes bytes = FileBytes::read(path);
      EXPECT_EQ(bytes.data()[bytes.size() - 1], static_cast<std::byte>('x'));
    } catch (const UserError& error) {
      const std::string message = error.what();
      shorter += message.find("it became shorter while it was read") != std::string::npos;
      written += message.find("it was written while it was read") != std::string::npos;
    }
  }
  done = true;
  writer.join();
}

}  // namespace
}  // namespace vrpipe
