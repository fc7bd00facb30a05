#include "support/data.h"

#include <lzma.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace vrpipe::testing {

std::filesystem::path data_file(const std::string& name) { return std::filesystem::path(VRPIPE_TEST_DATA) / name; }

std::string unpacked(const std::string& name) {
  std::ifstream file(data_file(name + ".xz"), std::ios::binary);
  const std::string packed((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  lzma_stream stream = LZMA_STREAM_INIT;
  lzma_ret status = lzma_stream_decoder(&stream, UINT64_MAX, 0);
  stream.next_in = reinterpret_cast<const std::uint8_t*>(packed.data());
  stream.avail_in = packed.size();
  std::string bytes;
  while (status == LZMA_OK) {
    bytes.resize(bytes.size() + (std::size_t{1} << 20U));
    stream.next_out = reinterpret_cast<std::uint8_t*>(bytes.data()) + stream.total_out;
    stream.avail_out = bytes.size() - stream.total_out;
    status = lzma_code(&stream, LZMA_FINISH);
  }
  bytes.resize(stream.total_out);
  lzma_end(&stream);
  if (status != LZMA_STREAM_END) throw std::runtime_error("tests/data/" + name + ".xz is missing or broken");
  return bytes;
}

UnpackedFile::UnpackedFile(const std::string& name) {
  std::string folder = (std::filesystem::temp_directory_path() / "vrpipe-data-XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr) throw std::runtime_error("no temporary folder");
  path_ = std::filesystem::path(folder) / name;
  const std::string bytes = unpacked(name);
  std::ofstream(path_, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

UnpackedFile::~UnpackedFile() {
  std::error_code ignored;
  std::filesystem::remove_all(path_.parent_path(), ignored);
}

}  // namespace vrpipe::testing
