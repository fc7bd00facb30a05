#include <vrpipe/workloads/gaussian_scene.h>

#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

#include <vrpipe/component/error.h>

namespace vrpipe {
namespace {

/// Offsets inside a record that we make: x y z f_dc f_rest opacity scale rot.
GaussianLayout canonical_layout(int sh_degree) {
  GaussianLayout layout;
  std::uint32_t offset = 0;
  const auto next = [&offset] {
    const std::uint32_t here = offset;
    offset += 4;
    return here;
  };
  for (auto& o : layout.position) o = next();
  for (auto& o : layout.f_dc) o = next();
  const std::size_t rest = 3 * std::size_t{kShRestPerChannel[static_cast<std::size_t>(sh_degree)]};
  for (std::size_t i = 0; i < rest; ++i) layout.f_rest[i] = next();
  layout.opacity = next();
  for (auto& o : layout.log_scale) o = next();
  for (auto& o : layout.rotation) o = next();
  return layout;
}

std::size_t canonical_floats(int sh_degree) {
  return 14 + 3 * std::size_t{kShRestPerChannel[static_cast<std::size_t>(sh_degree)]};
}

int checked_degree(int sh_degree) {
  if (sh_degree < 0 || sh_degree > 3) throw std::invalid_argument("SH degree must be 0 to 3");
  return sh_degree;
}

/// Floats that are not set. Large blocks lie in huge pages, where the system has them: a fault for each of 4096 bytes takes
/// longer than what is read into them.
std::shared_ptr<float[]> large_block(std::size_t floats) {
  constexpr std::size_t kHugePage = std::size_t{1} << 21U;
  const std::size_t bytes = floats * sizeof(float);
  if (bytes < 2 * kHugePage) return std::shared_ptr<float[]>(new float[floats]);
  const std::size_t padded = (bytes + kHugePage - 1) / kHugePage * kHugePage;
  void* const block = std::aligned_alloc(kHugePage, padded);
  if (block == nullptr) throw std::bad_alloc();
  madvise(block, padded, MADV_HUGEPAGE);
  return std::shared_ptr<float[]>(static_cast<float*>(block), [](float* begin) { std::free(begin); });
}

/// Calls block(values, count) for the parts of a record, in the order of canonical_layout().
template <class Block>
void for_each_block(const GaussianAttributes& gaussian, int sh_degree, const Block& block) {
  block(gaussian.position.data(), 3);
  block(gaussian.f_dc.data(), 3);
  for (const auto& channel : gaussian.f_rest)
    block(channel.data(), kShRestPerChannel[static_cast<std::size_t>(sh_degree)]);
  block(&gaussian.opacity_logit, 1);
  block(gaussian.log_scale.data(), 3);
  block(gaussian.rotation.data(), 4);
}

}  // namespace

GaussianScene::GaussianScene(std::shared_ptr<const void> storage, const std::byte* records, std::uint64_t count,
                             std::size_t stride_bytes, const GaussianLayout& layout, int sh_degree)
    : storage_(std::move(storage)),
      records_(records),
      count_(count),
      stride_bytes_(stride_bytes),
      layout_(std::make_shared<const GaussianLayout>(layout)),
      sh_degree_(sh_degree) {}

GaussianArray::GaussianArray(std::uint64_t count, int sh_degree, const std::string& where)
    : count_(count), sh_degree_(checked_degree(sh_degree)), floats_per_gaussian_(canonical_floats(sh_degree)) {
  const std::uint64_t stride = floats_per_gaussian_ * sizeof(float);
  try {
    if (count > std::numeric_limits<std::size_t>::max() / 2 / stride) throw std::bad_alloc();
    floats_ = large_block(static_cast<std::size_t>(count) * floats_per_gaussian_);
  } catch (const std::bad_alloc&) {
    throw UserError("cannot read scene", where,
                    "its " + std::to_string(count) + " Gaussians need " + std::to_string(stride) +
                        " bytes of memory each",
                    "raise the limit on memory, or use a smaller scene");
  }
}

void GaussianArray::set(std::uint64_t index, const GaussianAttributes& gaussian) {
  float* to = floats_.get() + static_cast<std::size_t>(index) * floats_per_gaussian_;
  for_each_block(gaussian, sh_degree_,
                 [&to](const float* values, std::size_t count) { to = std::copy_n(values, count, to); });
}

std::size_t GaussianArray::bytes_per_gaussian(int sh_degree) { return canonical_floats(sh_degree) * sizeof(float); }

GaussianScene GaussianArray::build() {
  const auto* records = reinterpret_cast<const std::byte*>(floats_.get());
  return GaussianScene(std::move(floats_), records, count_, floats_per_gaussian_ * sizeof(float),
                       canonical_layout(sh_degree_), sh_degree_);
}

GaussianSceneBuilder::GaussianSceneBuilder(int sh_degree)
    : sh_degree_(checked_degree(sh_degree)), floats_per_gaussian_(canonical_floats(sh_degree)) {}

void GaussianSceneBuilder::reserve(std::size_t gaussians) { floats_.reserve(gaussians * floats_per_gaussian_); }

void GaussianSceneBuilder::add(const GaussianAttributes& gaussian) {
  for_each_block(gaussian, sh_degree_, [this](const float* values, std::size_t count) {
    floats_.insert(floats_.end(), values, values + count);
  });
}

GaussianScene GaussianSceneBuilder::build() {
  const std::uint64_t count = size();
  auto storage = std::make_shared<const std::vector<float>>(std::move(floats_));
  floats_.clear();
  const auto* records = reinterpret_cast<const std::byte*>(storage->data());
  return GaussianScene(storage, records, count, floats_per_gaussian_ * sizeof(float), canonical_layout(sh_degree_),
                       sh_degree_);
}

}  // namespace vrpipe
