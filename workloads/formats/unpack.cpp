#include "formats/unpack.h"

#include <algorithm>
#include <array>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <png.h>
#include <webp/decode.h>
#include <zlib.h>
#include <zstd.h>

namespace vrpipe {
namespace {

constexpr char kDamagedRemedy[] = "get the file again";
constexpr char kPngMagic[] = "\x89PNG\r\n\x1a\n";

void check_size(const RgbaImage& image, const FileBytes& packed, std::uint64_t least, std::uint64_t most) {
  const std::uint64_t pixels = image.width * image.height;
  if (pixels >= least && pixels <= most) return;
  packed.fail("its image has " + std::to_string(image.width) + "x" + std::to_string(image.height) + " pixels, and " +
                  std::to_string(least) + " to " + std::to_string(most) + " are expected",
              "export the scene again");
}

/// The chunks of a .png in which its pixels are, without those by which libpng would correct them.
std::vector<std::byte> chunks_of_pixels(const FileBytes& packed) {
  const std::string what = "its .png";
  std::vector<std::byte> kept(packed.data(), packed.range(0, 8, what) + 8);
  for (std::uint64_t at = 8; at < packed.size();) {
    std::uint64_t length = 0;
    for (std::uint64_t i = 0; i < 4; ++i) length = length << 8U | packed.number<std::uint8_t>(at + i, what);
    const std::byte* const chunk = packed.range(at, 12 + length, what);
    const std::string kind(reinterpret_cast<const char*>(chunk + 4), 4);
    if (kind == "IHDR" && length >= 9 && std::to_integer<unsigned>(chunk[16]) != 8)
      packed.fail_at(at + 16, "its .png has no 8 bits a channel", "save it with 8, or as lossless WebP");
    for (const char* used : {"IHDR", "PLTE", "tRNS", "IDAT", "IEND"}) {
      if (kind == used) kept.insert(kept.end(), chunk, chunk + 12 + length);
    }
    if (kind == "IEND") break;
    at += 12 + length;
  }
  return kept;
}

RgbaImage unpack_png(const FileBytes& packed, std::uint64_t least, std::uint64_t most) {
  const std::vector<std::byte> chunks = chunks_of_pixels(packed);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  const std::unique_ptr<png_image, void (*)(png_image*)> freed(&png, png_image_free);
  const auto check = [&](int done) {
    if (done == 0) packed.fail(std::string("its .png is damaged: ") + png.message, kDamagedRemedy);
  };
  check(png_image_begin_read_from_memory(&png, chunks.data(), chunks.size()));
  RgbaImage image;
  image.width = png.width;
  image.height = png.height;
  check_size(image, packed, least, most);
  const std::uint64_t size = 4 * image.width * image.height;
  const std::shared_ptr<std::byte[]> bytes = allocate_bytes(size, packed.where());
  png.format = PNG_FORMAT_RGBA;
  check(png_image_finish_read(&png, nullptr, bytes.get(), 0, nullptr));
  image.pixels = FileBytes(bytes, size, packed.where());
  return image;
}

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

void GzipStream::read_on(const std::function<void(const std::byte* bytes, std::size_t size)>& take) {
  State& s = *state_;
  std::array<std::byte, 4096> next{};
  constexpr std::uint64_t kMost = std::uint64_t{16} << 20U;
  for (std::uint64_t done = 0; !s.ended; done += next.size()) {
    if (done > kMost) {
      s.packed.fail_at(s.position(),
                       "its gzip stream goes on, after the " + std::to_string(s.unpacked.size()) +
                           " bytes of its Gaussians",
                       kDamagedRemedy);
    }
    s.stream.next_out = reinterpret_cast<Bytef*>(next.data());
    s.stream.avail_out = static_cast<uInt>(next.size());
    s.ended = step() == Z_STREAM_END;
    take(next.data(), next.size() - s.stream.avail_out);
  }
}

void GzipStream::unpack_rest() {
  read_on([this](const std::byte* bytes, std::size_t size) {
    state_->unpacked.insert(state_->unpacked.end(), bytes, bytes + size);
  });
}

void GzipStream::finish() {
  read_on([](const std::byte*, std::size_t) {});
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

RgbaImage unpack_image(const FileBytes& packed, std::uint64_t least, std::uint64_t most) {
  if (packed.begins_with(kPngMagic)) return unpack_png(packed, least, most);
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
    packed.fail_at(0, "there is neither a lossless WebP image nor a .png", kDamagedRemedy);
  }
  RgbaImage image;
  image.width = static_cast<std::uint64_t>(features.width);
  image.height = static_cast<std::uint64_t>(features.height);
  const std::uint64_t pixels = image.width * image.height;
  check_size(image, packed, least, most);
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
