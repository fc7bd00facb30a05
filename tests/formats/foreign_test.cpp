// What other programs have in the place of a scene is named for what it is, with a remedy.
#include <cstdint>
#include <utility>

#include <vrpipe/workloads/gaussian_file.h>

#include "../workloads/workload_test_support.h"
#include "made_files.h"

namespace vrpipe {
namespace {

using testing::expect_user_error;
using testing::MadeFile;

/// CRC-32 of zip and gzip, bit by bit.
std::uint32_t crc_of(const std::string& bytes) {
  std::uint32_t crc = ~std::uint32_t{0};
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
  }
  return ~crc;
}

/// An archive of stored files, which hold their names.
std::string zip_of(const std::vector<std::string>& names) {
  MadeFile file, directory;
  for (const std::string& name : names) {
    const auto size = static_cast<std::uint32_t>(name.size()), offset = static_cast<std::uint32_t>(file.bytes().size());
    const auto fields = [&](MadeFile& to) {
      to.add(std::uint16_t{20}, std::uint16_t{0}, std::uint16_t{0}, std::uint32_t{0}, crc_of(name), size, size);
      to.add(static_cast<std::uint16_t>(size), std::uint16_t{0});
    };
    fields(file.text("PK\x03\x04"));
    file.text(name).text(name);
    fields(directory.text("PK\x01\x02").add(std::uint16_t{20}));
    directory.add(std::uint16_t{0}, std::uint16_t{0}, std::uint16_t{0}, std::uint32_t{0}, offset).text(name);
  }
  const auto count = static_cast<std::uint16_t>(names.size());
  MadeFile end;
  end.text("PK\x05\x06").add(std::uint16_t{0}, std::uint16_t{0}, count, count);
  end.add(static_cast<std::uint32_t>(directory.bytes().size()), static_cast<std::uint32_t>(file.bytes().size()),
          std::uint16_t{0});
  return file.bytes() + directory.bytes() + end.bytes();
}

/// A gzip stream of one stored block.
std::string gzip_of(const std::string& bytes) {
  const auto size = static_cast<std::uint16_t>(bytes.size());
  MadeFile file;
  file.text(std::string("\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03\x01", 11))
      .add(size, static_cast<std::uint16_t>(~size));
  return file.text(bytes).add(crc_of(bytes), std::uint32_t{size}).bytes();
}

class ForeignFiles : public testing::FolderTest {
 protected:
  void refused(const std::string& name, const std::string& bytes, const std::vector<std::string>& parts) const {
    SCOPED_TRACE(name);
    expect_user_error([&] { read_gaussian_file(write(name, bytes).string()); }, parts);
  }
};

TEST_F(ForeignFiles, AnArchiveIsNamedByWhatItHolds) {
  refused("a.ssproj", zip_of({"document.json", "splat_0.ply"}), {"project of SuperSplat", "export the scene"});
  refused("a.npz", zip_of({"means.npy", "quats.npy"}), {"arrays of NumPy", "INRIA's .ply"});
  refused("luma.zip", zip_of({"readme.txt", "scene/splats.ply"}), {"with `scene/splats.ply`", "unpack it"});
  refused("a.zip", zip_of({"readme.txt"}), {"no meta.json", ".sog"});
}

TEST_F(ForeignFiles, APackedPlyIsToBeUnpacked) {
  refused("a.ply.gz", gzip_of("ply\nformat binary_little_endian 1.0\n"), {"it is a .ply in a gzip stream", "gunzip"});
}

TEST_F(ForeignFiles, FormatsThatAreNotReadAreNamed) {
  const std::vector<std::pair<const char*, std::vector<std::string>>> formats = {
      {"a.lcc", {"XGRIDS", "splat-transform"}}, {"a.LCC2", {"XGRIDS", "splat-transform"}},
      {"a.spx", {"Reall3dViewer", "gsbox"}},    {"a.rad", {"Spark", "made from"}},
      {"a.ckpt", {"checkpoint", "ns-export"}},  {"a.pt", {"checkpoint", ".ply"}},
      {"a.usdz", {"OpenUSD", ".ply"}}};
  for (const auto& [name, parts] : formats) {
    refused(name, "anything", parts);
    // Checkpoints and .usdz are zip archives.
    refused(name, zip_of({"archive/data.pkl"}), parts);
  }
  refused("a.unheard_of", "anything", {"neither its content nor its name", "known are"});
}

}  // namespace
}  // namespace vrpipe
