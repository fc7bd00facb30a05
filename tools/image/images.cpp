#include "image/images.h"

#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Iex.h>
#include <ImathBox.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <png.h>

namespace vrpipe::tools {

SharedImage::SharedImage(std::uint32_t width, std::uint32_t height) : width_(width), height_(height) {
  void* const memory = ::mmap(nullptr, size_bytes(), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  values_ = static_cast<float*>(memory);
}

SharedImage::~SharedImage() {
  if (values_ != nullptr) ::munmap(values_, size_bytes());
}

SharedImage::SharedImage(SharedImage&& other) noexcept
    : width_(other.width_), height_(other.height_), values_(std::exchange(other.values_, nullptr)) {}

SharedImage& SharedImage::operator=(SharedImage&& other) noexcept {
  std::swap(width_, other.width_);
  std::swap(height_, other.height_);
  std::swap(values_, other.values_);
  return *this;
}

void SharedImage::copy_from(const ColorSurface& surface) {
  float* out = values_;
  for (std::uint32_t y = 0; y < height_; ++y) {
    for (std::uint32_t x = 0; x < width_; ++x) {
      const std::array<float, 4> pixel = surface.pixel(x, y);
      out = std::copy(pixel.begin(), pixel.end(), out);
    }
  }
}

namespace {

std::uint8_t to_byte(float value) {
  if (!(value > 0)) return 0;  // NaN too
  return value >= 1 ? std::uint8_t{255} : static_cast<std::uint8_t>(value * 255.0F + 0.5F);
}

/// Ends libpng's handle however the function is left. Errors become exceptions in the callback below.
struct PngWriter {
  png_structp png = nullptr;
  png_infop info = nullptr;
  ~PngWriter() { png_destroy_write_struct(&png, &info); }
};

[[noreturn]] void png_failed(png_structp, png_const_charp message) {
  throw std::runtime_error(std::string("libpng: ") + message);
}

void append(png_structp png, png_bytep data, std::size_t size) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(data), size);
}

/// libpng's own would take the string for a FILE.
void flush_nothing(png_structp) {}

/// @param fill_row  writes the 3 * width bytes of row y
template <class FillRow>
std::string encode_rows(std::uint32_t width, std::uint32_t height, const FillRow& fill_row) {
  std::string file;
  PngWriter writer;
  writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, png_failed, nullptr);
  if (writer.png == nullptr) throw std::bad_alloc();
  writer.info = png_create_info_struct(writer.png);
  if (writer.info == nullptr) throw std::bad_alloc();
  png_set_write_fn(writer.png, &file, append, flush_nothing);
  png_set_IHDR(writer.png, writer.info, width, height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(writer.png, writer.info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_write_info(writer.png, writer.info);
  std::vector<std::uint8_t> row(std::size_t{3} * width);
  for (std::uint32_t y = 0; y < height; ++y) {
    fill_row(y, row);
    png_write_row(writer.png, row.data());
  }
  png_write_end(writer.png, writer.info);
  return file;
}

}  // namespace

std::string encode_png(const SharedImage& image, const std::array<float, 3>& background) {
  return encode_rows(image.width(), image.height(), [&](std::uint32_t y, std::vector<std::uint8_t>& row) {
    const float* pixel = image.values() + std::size_t{4} * y * image.width();
    for (std::uint32_t x = 0; x < image.width(); ++x, pixel += 4) {
      const float transmittance = 1.0F - pixel[3];
      for (std::size_t channel = 0; channel < 3; ++channel) {
        row[std::size_t{3} * x + channel] = to_byte(pixel[channel] + transmittance * background[channel]);
      }
    }
  });
}

std::string encode_png(std::uint32_t width, std::uint32_t height, const std::vector<std::uint8_t>& rgb) {
  return encode_rows(width, height, [&](std::uint32_t y, std::vector<std::uint8_t>& row) {
    std::copy_n(rgb.begin() + static_cast<std::ptrdiff_t>(row.size() * y), row.size(), row.begin());
  });
}

namespace {
std::string exr_of(const Imf::Header& header, const Imf::FrameBuffer& pixels, std::uint32_t height) {
  Imf::StdOSStream stream;
  {
    Imf::OutputFile file(stream, header);
    file.setFrameBuffer(pixels);
    file.writePixels(static_cast<int>(height));
  }
  return stream.str();
}
}  // namespace

std::string encode_exr(std::uint32_t width, std::uint32_t height, const std::vector<NamedChannel>& channels) {
  Imf::Header header(static_cast<int>(width), static_cast<int>(height));
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer pixels;
  for (const NamedChannel& channel : channels) {
    header.channels().insert(channel.name, Imf::Channel(Imf::FLOAT));
    char* const first = reinterpret_cast<char*>(const_cast<float*>(channel.values.data()));
    pixels.insert(channel.name, Imf::Slice(Imf::FLOAT, first, sizeof(float), sizeof(float) * width));
  }
  return exr_of(header, pixels, height);
}

std::string encode_exr(const SharedImage& image) {
  Imf::Header header(static_cast<int>(image.width()), static_cast<int>(image.height()));
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer pixels;
  const std::size_t row_bytes = std::size_t{16} * image.width();
  // OpenEXR takes one type of pointer for reading and writing.
  char* const first = reinterpret_cast<char*>(const_cast<float*>(image.values()));
  std::size_t offset = 0;
  for (const char* channel : {"R", "G", "B", "A"}) {
    header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
    pixels.insert(channel, Imf::Slice(Imf::FLOAT, first + offset, 16, row_bytes));
    offset += sizeof(float);
  }
  return exr_of(header, pixels, image.height());
}

SharedImage read_exr(const std::string& path) {
  try {
    Imf::InputFile file(path.c_str(), 1);
    const Imath::Box2i window = file.header().dataWindow();
    constexpr int most = 16384;
    const int width = window.max.x - window.min.x + 1, height = window.max.y - window.min.y + 1;
    if (width < 1 || height < 1 || width > most || height > most)
      throw std::runtime_error(path + ": of no usable size");
    SharedImage image(static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height));
    Imf::FrameBuffer pixels;
    const std::size_t row_bytes = std::size_t{16} * image.width();
    const std::ptrdiff_t before =
        window.min.x * std::ptrdiff_t{16} + window.min.y * static_cast<std::ptrdiff_t>(row_bytes);
    char* const first = reinterpret_cast<char*>(image.values()) - before;
    std::size_t offset = 0;
    for (const char* channel : {"R", "G", "B", "A"}) {
      pixels.insert(channel, Imf::Slice(Imf::FLOAT, first + offset, 16, row_bytes));
      offset += sizeof(float);
    }
    file.setFrameBuffer(pixels);
    file.readPixels(window.min.y, window.max.y);
    return image;
  } catch (const Iex::BaseExc& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

}  // namespace vrpipe::tools
