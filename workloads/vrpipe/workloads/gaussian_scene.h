#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace vrpipe {

/// Number of f_rest coefficients per colour channel at SH degree 0, 1, 2, 3: (degree + 1)^2 - 1.
constexpr std::array<std::uint32_t, 4> kShRestPerChannel = {0, 3, 8, 15};

/// Where each attribute of a Gaussian lies inside its record, in bytes from the record's start. Every attribute is a
/// float32, possibly unaligned. f_rest is channel-major (all red, then all green, then all blue), as INRIA writes it.
struct GaussianLayout {
  std::array<std::uint32_t, 3> position{};   ///< x, y, z
  std::array<std::uint32_t, 3> log_scale{};  ///< scale_0..2
  std::array<std::uint32_t, 4> rotation{};   ///< rot_0..3 = w, x, y, z
  std::uint32_t opacity = 0;                 ///< logit
  std::array<std::uint32_t, 3> f_dc{};       ///< SH degree 0, red, green, blue
  std::array<std::uint32_t, 45> f_rest{};    ///< first 3 * kShRestPerChannel[degree] are used
};

/// The attributes of one Gaussian, read where they lie (no copy is kept). Cheap to copy; valid while the scene lives.
class GaussianRef {
 public:
  GaussianRef(const std::byte* record, const GaussianLayout* layout, int sh_degree)
      : record_(record), layout_(layout), sh_degree_(sh_degree) {}

  std::array<float, 3> position() const { return load_all(layout_->position); }
  std::array<float, 3> log_scale() const { return load_all(layout_->log_scale); }
  std::array<float, 4> rotation() const { return load_all(layout_->rotation); }  ///< w, x, y, z; not normalised
  float opacity_logit() const { return load(layout_->opacity); }
  std::array<float, 3> f_dc() const { return load_all(layout_->f_dc); }
  int sh_degree() const { return sh_degree_; }

  /// SH coefficient `coefficient` (1 .. (degree+1)^2 - 1) of colour channel `channel` (0 red, 1 green, 2 blue).
  float f_rest(std::uint32_t channel, std::uint32_t coefficient) const {
    const std::uint32_t per_channel = kShRestPerChannel[static_cast<std::size_t>(sh_degree_)];
    return load(layout_->f_rest[channel * per_channel + coefficient - 1]);
  }

 private:
  float load(std::uint32_t offset) const {
    float value;
    std::memcpy(&value, record_ + offset, sizeof value);
    return value;
  }
  template <std::size_t N>
  std::array<float, N> load_all(const std::array<std::uint32_t, N>& offsets) const {
    std::array<float, N> values;
    for (std::size_t i = 0; i < N; ++i) values[i] = load(offsets[i]);
    return values;
  }

  const std::byte* record_;
  const GaussianLayout* layout_;
  int sh_degree_;
};

/// A set of 3D Gaussians: records of equal stride somewhere in memory (of a file, or of a block of floats).
/// Copies share the records. Immutable, so safe to read from any number of threads.
class GaussianScene {
 public:
  GaussianScene() = default;

  /// @param storage  keeps `records` alive
  GaussianScene(std::shared_ptr<const void> storage, const std::byte* records, std::uint64_t count,
                std::size_t stride_bytes, const GaussianLayout& layout, int sh_degree);

  std::uint64_t size() const { return count_; }
  bool empty() const { return count_ == 0; }
  int sh_degree() const { return sh_degree_; }  ///< 0 to 3

  /// Where in the world positions of Gaussians count from: not zero for a scene of double positions far from the world's origin.
  const std::array<double, 3>& origin() const { return origin_; }
  void set_origin(const std::array<double, 3>& origin) { origin_ = origin; }
  /// Whether it was trained anti-aliased, so that PreprocessOptions::opacity_compensation is how it is meant to be drawn.
  bool compensates_opacity() const { return compensates_opacity_; }
  void set_compensates_opacity(bool compensates) { compensates_opacity_ = compensates; }
  /// Of one of its Gaussians, rounded to single precision.
  std::array<float, 3> world_position(const GaussianRef& gaussian) const {
    std::array<float, 3> position = gaussian.position();
    for (std::size_t i = 0; i < 3; ++i) position[i] = static_cast<float>(origin_[i] + static_cast<double>(position[i]));
    return position;
  }

  /// Gaussian `index` < size().
  GaussianRef operator[](std::uint64_t index) const {
    return GaussianRef(records_ + static_cast<std::size_t>(index) * stride_bytes_, layout_.get(), sh_degree_);
  }

  /// Of all Gaussians, one after the other.
  const std::byte* records() const { return records_; }

  /// Asks the host's caches for Gaussian `index` < size(), for who reads in another order than the file's.
  void prefetch(std::uint64_t index) const {
    constexpr std::size_t kLine = 64;
    const std::byte* const record = records_ + static_cast<std::size_t>(index) * stride_bytes_;
    for (std::size_t offset = 0; offset < stride_bytes_; offset += kLine) __builtin_prefetch(record + offset);
  }

 private:
  std::shared_ptr<const void> storage_;
  const std::byte* records_ = nullptr;
  std::uint64_t count_ = 0;
  std::size_t stride_bytes_ = 0;
  std::shared_ptr<const GaussianLayout> layout_ = std::make_shared<const GaussianLayout>();
  int sh_degree_ = 0;
  std::array<double, 3> origin_{};
  bool compensates_opacity_ = false;
};

/// The attributes of a Gaussian to add to a scene; f_rest[channel][coefficient - 1], unused ones are ignored.
struct GaussianAttributes {
  std::array<float, 3> position{};
  std::array<float, 3> log_scale{};
  std::array<float, 4> rotation{1, 0, 0, 0};  ///< w, x, y, z
  float opacity_logit = 0;
  std::array<float, 3> f_dc{};
  std::array<std::array<float, 15>, 3> f_rest{};
};

/// Room for a known number of Gaussians, each of which is set once, on any thread.
class GaussianArray {
 public:
  /// @param where  what the Gaussians are of, for the message
  /// @throws UserError when there is not so much memory; std::invalid_argument when sh_degree is not 0 to 3
  GaussianArray(std::uint64_t count, int sh_degree, const std::string& where);

  /// @pre index < count
  void set(std::uint64_t index, const GaussianAttributes& gaussian);

  /// What a Gaussian takes: position, f_dc, f_rest, opacity, scale, rotation, all float32. sh_degree is 0 to 3.
  static std::size_t bytes_per_gaussian(int sh_degree);
  /// All of them, to be read in as they lie in a scene that build() has made.
  std::byte* bytes() { return reinterpret_cast<std::byte*>(floats_.get()); }

  /// Hands the Gaussians over; those that were not set hold anything.
  GaussianScene build();

 private:
  std::uint64_t count_;
  int sh_degree_;
  std::size_t floats_per_gaussian_;
  std::shared_ptr<float[]> floats_;
};

/// Collects Gaussians in memory, in one block of floats.
class GaussianSceneBuilder {
 public:
  /// @throws std::invalid_argument when sh_degree is not 0 to 3
  explicit GaussianSceneBuilder(int sh_degree);

  void reserve(std::size_t gaussians);
  void add(const GaussianAttributes& gaussian);
  std::size_t size() const { return floats_.size() / floats_per_gaussian_; }

  /// Hands the Gaussians over; the builder is empty afterwards.
  GaussianScene build();

 private:
  int sh_degree_;
  std::size_t floats_per_gaussian_;
  std::vector<float> floats_;
};

}  // namespace vrpipe
