#include "formats/unpack.h"

#include <algorithm>
#include <array>
#include <new>
#include <vector>

#include <webp/decode.h>
#include <zlib.h>
#include <zstd.h>

namespace vrpipe {
namespace {

constexpr char kDamagedRemedy[] = "get the file again";

}  // namespace

struct GzipStream::State {
  FileBytes packed;
  z_stream stream{};
  std::vector<std::byte> unpacked;
  std::uint64_t given = 0;  ///< bytes of `packed` that zlib has, or had
  bool ended = false;       ///< the stream, with a checksum that is right

  std::uint64_t position() const { return given - stream.avail_in; }
};

GzipStream::GzipStream(const FileBytes& packed) : state_(std::make_unique<State>()) {
  state_->packed = packed;
  constexpr int kGzipOnly = 16;
  if (inflateInit2(&state_->stream, MAX_WBITS + kGzipOnly) != Z_OK) throw std::bad_alloc();
}

GzipStream::~GzipStream() { inflateEnd(&state_->stream); }

/// Unpacks until there is no more room for it, or the stream's end: Z_OK or Z_STREAM_END.
int GzipStream::step() {
  State& s = *state_;
  constexpr std::uint64_t kStep = std::uint64_t{1} << 20U;
  while (s.stream.avail_out > 0) {
    if (s.stream.avail_in == 0) {
      const std::uint64_t next = std::min(kStep, s.packed.size() - s.given);
      if (next == 0) {
        s.packed.fail("it ends at byte " + std::to_string(s.packed.size()) + ", within its gzip stream, after " +
                          std::to_string(s.stream.total_out) + " bytes unpacked",
                      "get the file again, it seems cut short");
      }
      // zlib does not write to its input.
      s.stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(s.packed.data() + s.given));
      s.stream.avail_in = static_cast<uInt>(next);
      s.given += next;
    }
    const int status = inflate(&s.stream, Z_NO_FLUSH);
    if (status == Z_OK) continue;
    if (status == Z_STREAM_END) return status;
    if (status == Z_MEM_ERROR) throw std::bad_alloc();
    const std::string why = s.stream.msg == nullptr ? "" : std::string(": ") + s.stream.msg;
    s.packed.fail_at(s.position(), "its gzip stream is damaged" + why, kDamagedRemedy);
  }
  return Z_OK;
}

void GzipStream::unpack(std::uint64_t size) {
  State& s = *state_;
  constexpr std::uint64_t kStep = std::uint64_t{1} << 20U;
  while (size > 0) {
    const std::uint64_t before = s.unpacked.size(), now = std::min(size, kStep);
    s.unpacked.resize(static_cast<std::size_t>(before + now));
    s.stream.next_out = reinterpret_cast<Bytef*>(s.unpacked.data() + before);
    s.stream.avail_out = static_cast<uInt>(now);
    s.ended = s.ended || step() == Z_STREAM_END;
    if (s.stream.avail_out > 0) {
      s.packed.fail_at(s.position(),
                       "its gzip stream ends after " + std::to_string(before + now - s.stream.avail_out) +
                           " bytes unpacked, and " + std::to_string(before + size) + " are needed",
                       kDamagedRemedy);
    }
    size -= now;
  }
}

void GzipStream::finish() {
  State& s = *state_;
  std::array<std::byte, 4096> dropped{};
  constexpr std::uint64_t kMost = std::uint64_t{16} << 20U;
  for (std::uint64_t done = 0; !s.ended; done += dropped.size()) {
    if (done > kMost) {
      s.packed.fail_at(s.position(),
                       "its gzip stream goes on, after the " + std::to_string(s.unpacked.size()) +
                           " bytes of its Gaussians",
                       kDamagedRemedy);
    }
    s.stream.next_out = reinterpret_cast<Bytef*>(dropped.data());
    s.stream.avail_out = static_cast<uInt>(dropped.size());
    s.ended = step() == Z_STREAM_END;
  }
}

FileBytes GzipStream::first(std::uint64_t size) const {
  return FileBytes::copy(state_->unpacked.data(), size, state_->packed.where() + ", unpacked");
}

FileBytes GzipStream::take() {
  auto bytes = std::make_shared<std::vector<std::byte>>(std::move(state_->unpacked));
  const std::uint64_t size = bytes->size();
  const std::byte* const data = bytes->data();
  return FileBytes(std::shared_ptr<const std::byte[]>(bytes, data), size, state_->packed.where() + ", unpacked");
}

FileBytes unpack_zstd(const FileBytes& packed, std::uint64_t offset, std::uint64_t size, std::uint64_t unpacked_size,
                      const std::string& what) {
  const std::byte* const frame = packed.range(offset, size, what);
  // The frame's own word is heard before memory is given; the greatest window or block says nothing of a short frame.
  const unsigned long long announced = ZSTD_getFrameContentSize(frame, static_cast<std::size_t>(size));
  if (announced != ZSTD_CONTENTSIZE_UNKNOWN && announced != unpacked_size) {
    packed.fail_at(offset, what + " is no Zstandard frame of " + std::to_string(unpacked_size) + " bytes unpacked",
                   kDamagedRemedy);
  }
  const std::shared_ptr<std::byte[]> bytes = allocate_bytes(unpacked_size, packed.where());
  const std::size_t done =
      ZSTD_decompress(bytes.get(), static_cast<std::size_t>(unpacked_size), frame, static_cast<std::size_t>(size));
  if (ZSTD_isError(done) != 0 || done != unpacked_size) {
    packed.fail_at(offset,
                   what + " is damaged: " +
                       (ZSTD_isError(done) != 0 ? std::string(ZSTD_getErrorName(done))
                                                : "it unpacks to " + std::to_string(done) + " bytes, and " +
                                                      std::to_string(unpacked_size) + " are needed"),
                   kDamagedRemedy);
  }
  return FileBytes(bytes, unpacked_size, packed.where() + ", " + what);
}

RgbaImage unpack_webp(const FileBytes& packed, std::uint64_t least, std::uint64_t most) {
  const auto* const data = reinterpret_cast<const std::uint8_t*>(packed.data());
  const std::size_t size = static_cast<std::size_t>(packed.size());
  WebPBitstreamFeatures features;
  const VP8StatusCode status = WebPGetFeatures(data, size, &features);
  if (status == VP8_STATUS_NOT_ENOUGH_DATA) {
    packed.fail("it ends at byte " + std::to_string(size) + ", within the header of a WebP image",
                "get the file again, it seems cut short");
  }
  constexpr int kLossless = 2;
  if (status != VP8_STATUS_OK || features.has_animation != 0 || features.format != kLossless) {
    packed.fail_at(0, "there is no lossless WebP image", kDamagedRemedy);
  }
  RgbaImage image;
  image.width = static_cast<std::uint64_t>(features.width);
  image.height = static_cast<std::uint64_t>(features.height);
  const std::uint64_t pixels = image.width * image.height;
  if (pixels < least || pixels > most) {
    packed.fail("its image has " + std::to_string(image.width) + "x" + std::to_string(image.height) + " pixels, and " +
                    std::to_string(least) + " to " + std::to_string(most) + " are expected",
                "export the scene again");
  }
  const std::shared_ptr<std::byte[]> bytes = allocate_bytes(4 * pixels, packed.where());
  WebPDecoderConfig config;
  if (WebPInitDecoderConfig(&config) == 0) throw std::bad_alloc();
  config.output.colorspace = MODE_RGBA;
  config.output.is_external_memory = 1;
  config.output.u.RGBA.rgba = reinterpret_cast<std::uint8_t*>(bytes.get());
  config.output.u.RGBA.stride = 4 * features.width;
  config.output.u.RGBA.size = static_cast<std::size_t>(4 * pixels);
  switch (WebPDecode(data, size, &config)) {
    case VP8_STATUS_OK: break;
    case VP8_STATUS_OUT_OF_MEMORY: throw std::bad_alloc();
    case VP8_STATUS_SUSPENDED:
    case VP8_STATUS_NOT_ENOUGH_DATA:
      packed.fail("it ends at byte " + std::to_string(size) + ", within its WebP image",
                  "get the file again, it seems cut short");
    default: packed.fail("its WebP image of " + std::to_string(size) + " bytes is damaged", kDamagedRemedy);
  }
  image.pixels = FileBytes(bytes, 4 * pixels, packed.where());
  return image;
}

}  // namespace vrpipe
