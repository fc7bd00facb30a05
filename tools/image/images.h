#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <vrpipe/pipeline/surface.h>

namespace vrpipe::tools {

/// Premultiplied RGBA in floats, row by row from the top, in memory that processes forked later share.
class SharedImage {
 public:
  /// All zero. Pages take memory only once they are written.
  SharedImage(std::uint32_t width, std::uint32_t height);
  ~SharedImage();
  SharedImage(SharedImage&& other) noexcept;
  SharedImage& operator=(SharedImage&& other) noexcept;
  SharedImage(const SharedImage&) = delete;
  SharedImage& operator=(const SharedImage&) = delete;

  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }
  /// 4 * width * height values.
  float* values() { return values_; }
  const float* values() const { return values_; }

  /// Takes the pixels of a surface of the same size.
  void copy_from(const ColorSurface& surface);

 private:
  std::size_t size_bytes() const { return sizeof(float) * 4 * width_ * height_; }

  std::uint32_t width_;
  std::uint32_t height_;
  float* values_ = nullptr;
};

/// A PNG file: 8-bit RGB, the image over a background colour. Values are display values, as Gaussian splats are trained
/// in display space: clamped to [0, 1] and rounded to the nearest n/255, without a gamma curve.
std::string encode_png(const SharedImage& image, const std::array<float, 3>& background);

/// A PNG file of display values.
/// @param rgb  3 * width * height bytes, row by row from the top
std::string encode_png(std::uint32_t width, std::uint32_t height, const std::vector<std::uint8_t>& rgb);

/// An OpenEXR file: RGBA float32, premultiplied, without a background.
std::string encode_exr(const SharedImage& image);

/// A value of each pixel, row by row from the top.
struct NamedChannel {
  std::string name;
  std::vector<float> values;  ///< width * height
};
/// An OpenEXR file of any channels, float32.
std::string encode_exr(std::uint32_t width, std::uint32_t height, const std::vector<NamedChannel>& channels);

/// Reads one of `encode_exr(image)`; channels that it does not have are 0. Throws std::runtime_error.
SharedImage read_exr(const std::string& path);

}  // namespace vrpipe::tools
