#include "render/render.h"

#include <algorithm>
#include <type_traits>

#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {
constexpr std::uint32_t lanes_of_warp = 32;

std::uint32_t mask_of(const LanePairBits (&bits)[4]) {
  std::uint32_t mask = 0;
  for (unsigned i = 0; i < 4; ++i) mask |= sign_mask(bits[i]) << (8 * i);
  return mask;
}

std::uint32_t count_bits(std::uint32_t mask) { return static_cast<std::uint32_t>(__builtin_popcount(mask)); }
}  // namespace

std::uint32_t TileKernel::WarpLanes::alive_mask() const {
  std::uint32_t mask = 0;
  for (unsigned i = 0; i < vectors; ++i) mask |= sign_mask(pixels[i].alive) << (8 * i);
  return mask;
}

TileKernel::TileKernel(const TileKernelParameters& parameters, const RenderContext& context, StopRule rule,
                       float least_transmittance)
    : rule_(rule),
      least_transmittance_(least_transmittance),
      pruning_threshold_(context.frame->draws().empty() ? 0 : context.state(0).pruning_threshold),
      terminating_alpha_(context.frame->draws().empty() ? 1 : context.state(0).terminating_alpha()),
      width_(context.frame->width()),
      height_(context.frame->height()),
      tiling_(width_, height_),
      warp_width_(parameters.warp_pixels == 0U ? 16 : 8),
      outside_(parameters.outside_instructions.thousandths()),
      pruned_(parameters.pruned_instructions.thousandths()),
      stopping_(parameters.stopping_instructions.thousandths()),
      blending_(parameters.blending_instructions.thousandths()),
      batch_(parameters.batch_instructions.thousandths()),
      timing_{parameters.blocks_per_core, parameters.issue_rate.thousandths(), parameters.instruction_interval_cycles,
              parameters.launch_microseconds},
      fragments_(context.fragments) {
  records_.reserve(context.frame->splats());
  for (const DrawCall& call : context.frame->draws()) {
    for (std::uint32_t number = call.base; number < call.base + call.splats && !call.geometry->is_mesh(); ++number) {
      records_.push_back(splat_record(call.splat(number)));
    }
  }
}

void TileKernel::use_surfaces(Framebuffer& framebuffer) { color_ = &framebuffer.color; }

std::uint32_t TileKernel::pixel_x(std::size_t tile, std::uint32_t warp, unsigned lane) const {
  const std::uint32_t across = screen_tile_pixels / warp_width_;  // warps side by side
  return tiling_.tile(tile).x * screen_tile_pixels + warp % across * warp_width_ + lane % warp_width_;
}

std::uint32_t TileKernel::pixel_y(std::size_t tile, std::uint32_t warp, unsigned lane) const {
  const std::uint32_t across = screen_tile_pixels / warp_width_;
  return tiling_.tile(tile).y * screen_tile_pixels + warp / across * (lanes_of_warp / warp_width_) + lane / warp_width_;
}

TileKernel::WarpLanes TileKernel::begin(std::size_t tile, std::uint32_t warp) const {
  WarpLanes lanes{};
  for (unsigned lane = 0; lane < lanes_of_warp; ++lane) {
    const std::uint32_t x = pixel_x(tile, warp, lane);
    const std::uint32_t y = pixel_y(tile, warp, lane);
    SplatPixels& pixels = lanes.pixels[lane / 8];
    pixels.x[lane % 8] = static_cast<float>(x) + 0.5F;
    pixels.y[lane % 8] = static_cast<float>(y) + 0.5F;
    pixels.alive[lane % 8] = x < width_ && y < height_ ? -1 : 0;
  }
  for (SplatPixels& pixels : lanes.pixels) pixels.transmittance = splat_pair(1);
  return lanes;
}

template <StopRule Rule>
TileKernel::Fates TileKernel::look_at(const SplatRecord& splat, WarpLanes& lanes) const {
  SplatAlphas alphas[vectors];
  LanePairBits inside[vectors], visible[vectors], blended[vectors];
  for (unsigned i = 0; i < vectors; ++i) {
    alphas[i] = splat_alphas(splat, lanes.pixels[i], pruning_threshold_);
    inside[i] = alphas[i].inside;
    visible[i] = alphas[i].visible;
  }
  Fates fates;
  fates.inside = mask_of(inside);
  fates.visible = mask_of(visible);
  if (fates.visible == 0) return fates;
  for (unsigned i = 0; i < vectors; ++i) {
    const float limit = Rule == StopRule::before ? least_transmittance_ : terminating_alpha_;
    blended[i] = blend_splat<Rule>(splat, alphas[i], limit, lanes.pixels[i]);
  }
  fates.blended = mask_of(blended);
  return fates;
}

std::uint64_t TileKernel::count(const Fates& fates, std::uint32_t alive, std::uint64_t& lane_instructions) {
  const std::uint32_t living = count_bits(alive);
  const std::uint32_t visible = count_bits(fates.visible);
  const std::uint32_t blended = count_bits(fates.blended);
  const std::uint32_t inside = count_bits(fates.inside & alive);
  lane_instructions += blended * blending_ + (visible - blended) * stopping_ + (inside - visible) * pruned_ +
                       (living - inside) * outside_;
  ++warp_iterations;
  lanes_dead += lanes_of_warp - living;
  lanes_pruned += living - visible;
  lanes_stopping += visible - blended;
  lanes_blending += blended;
  if (blended != 0) {
    ++iterations_blending;
    return blending_;
  }
  ++iterations_without_blending;
  if (visible != 0) {
    ++iterations_stopping;
    return stopping_;
  }
  if (fates.inside != 0) {
    ++iterations_pruned;
    return pruned_;
  }
  ++iterations_outside;
  return outside_;
}

void TileKernel::tell(std::size_t tile, std::uint32_t warp, const Fates& fates, std::uint32_t in_frame,
                      std::uint32_t alive) const {
  const std::uint32_t quads = warp_width_ / 2;  // side by side
  const auto tell_of = [&](FragmentFate fate, std::uint32_t lanes) {
    for (std::uint32_t quad = 0; quad < lanes_of_warp / 4; ++quad) {
      const std::uint32_t lane = quad / quads * 2 * warp_width_ + quad % quads * 2;
      const std::uint32_t rows = (lanes >> lane & 3U) | (lanes >> (lane + warp_width_) & 3U) << 2U;
      if (rows == 0) continue;
      const std::uint32_t x = pixel_x(tile, warp, lane) % screen_tile_pixels;
      const std::uint32_t y = pixel_y(tile, warp, lane) % screen_tile_pixels;
      fragments_->happened(fate, tiling_.tile(tile), y / 2 * quads_per_tile_row + x / 2, static_cast<LaneMask>(rows));
    }
  };
  tell_of(FragmentFate::rasterized, in_frame);
  tell_of(FragmentFate::terminated, (in_frame & ~alive) | (fates.visible & ~fates.blended));
  tell_of(FragmentFate::blended, fates.blended);
}

template <StopRule Rule, bool IsSeen>
void TileKernel::render_by(std::size_t tile, const std::uint32_t* splats, std::uint32_t length, BlockWork& out) {
  const std::uint32_t all_batches = (length + batch_splats - 1) / batch_splats;
  std::array<std::uint32_t, warps> lived{};  // batches that a warp began alive
  out.warps = warps;
  out.instructions.assign(std::size_t{all_batches} * warps, batch_);
  out.lane_instructions = 0;
  std::uint32_t begun = 0;  // batches of the block
  for (std::uint32_t warp = 0; warp < warps; ++warp) {
    WarpLanes lanes = begin(tile, warp);
    std::uint32_t alive = lanes.alive_mask();
    const std::uint32_t in_frame = alive;
    const std::uint64_t iterations = warp_iterations.value();
    while (lived[warp] < all_batches && alive != 0) {
      std::uint64_t& instructions = out.instructions[std::size_t{lived[warp]} * warps + warp];
      std::uint32_t next = lived[warp]++ * batch_splats;
      const std::uint32_t end = std::min(next + batch_splats, length);
      for (; next < end && alive != 0; ++next) {
        const Fates fates = look_at<Rule>(records_[splats[next]], lanes);
        instructions += count(fates, alive, out.lane_instructions);
        if constexpr (IsSeen) tell(tile, warp, fates, in_frame, alive);
        if constexpr (Rule != StopRule::none) alive = lanes.alive_mask();
      }
    }
    lanes_off_frame_ += (lanes_of_warp - count_bits(in_frame)) * (warp_iterations.value() - iterations);
    begun = std::max(begun, lived[warp]);
    if (color_ != nullptr) store(tile, warp, lanes);
  }
  out.instructions.resize(std::size_t{begun} * warps);
  out.lane_instructions += std::uint64_t{begun} * warps * lanes_of_warp * batch_;
  batches += std::uint64_t{begun} * warps;
  for (const std::uint32_t of_warp : lived) batches_of_dead_warps += begun - of_warp;
  constexpr std::uint64_t entry_bytes = 28;  // number, centre, inverse covariance, opacity
  constexpr std::uint64_t pixel_bytes = 16;
  bytes_ += std::min(std::uint64_t{begun} * batch_splats, std::uint64_t{length}) * entry_bytes;
  bytes_ += pixel_bytes * screen_tile_pixels * screen_tile_pixels;
}

void TileKernel::render(std::size_t tile, const std::uint32_t* splats, std::uint32_t length, BlockWork& out) {
  const auto render_for = [&](auto is_seen) {
    switch (rule_) {
      case StopRule::none: return render_by<StopRule::none, is_seen>(tile, splats, length, out);
      case StopRule::before: return render_by<StopRule::before, is_seen>(tile, splats, length, out);
      case StopRule::after: return render_by<StopRule::after, is_seen>(tile, splats, length, out);
    }
  };
  fragments_ != nullptr ? render_for(std::true_type()) : render_for(std::false_type());
}

void TileKernel::add_to(Counts& counts, const CountOf& of) const {
  const std::uint64_t terminated = of(lanes_dead) - lanes_off_frame_;
  const std::uint64_t shaded = of(lanes_blending) + of(lanes_stopping) + of(lanes_pruned);
  counts.fragments_rasterized += terminated + shaded;
  counts.fragments_terminated += terminated;
  counts.fragments_shaded += shaded;
  counts.fragments_pruned += of(lanes_pruned);
  counts.fragments_dropped_late += of(lanes_stopping);
  counts.fragments_blended += of(lanes_blending);
}

void TileKernel::store(std::size_t tile, std::uint32_t warp, const WarpLanes& lanes) {
  for (unsigned lane = 0; lane < lanes_of_warp; ++lane) {
    store_pixel(lanes.pixels[lane / 8], lane % 8, pixel_x(tile, warp, lane), pixel_y(tile, warp, lane), *color_);
  }
}

namespace {
constexpr const char* fitted_instructions = "measured on a GH100: instructions of 15 lists, within 0.11 %";
constexpr double sass_stopping = 41;
}  // namespace

PublishedKernel::Parameters::Parameters() : TileKernelParameters({38.0, sass_stopping, 59.7, fitted_instructions}) {}
EndlessKernel::Parameters::Parameters() : TileKernelParameters({35.3, sass_stopping, 48.2, fitted_instructions}) {}
ThresholdKernel::Parameters::Parameters() : TileKernelParameters({38.1, sass_stopping, 58.2, fitted_instructions}) {}

PublishedKernel::PublishedKernel(const Parameters& parameters, const RenderContext& context)
    : TileKernel(parameters, context, StopRule::before,
                 static_cast<float>(static_cast<double>(parameters.least_transmittance))) {}
EndlessKernel::EndlessKernel(const Parameters& parameters, const RenderContext& context)
    : TileKernel(parameters, context, StopRule::none) {}
ThresholdKernel::ThresholdKernel(const Parameters& parameters, const RenderContext& context)
    : TileKernel(parameters, context, StopRule::after) {}

namespace {
const OutsideSlotRegistrar render_slot("render", 220, "published");
const Registrar<PublishedKernel, RenderBehaviour> published_kernel(
    "render", "published", "the published kernel: a pixel stops before the splat that would bring T under 1e-4", false,
    Trust::trusted);
const Registrar<EndlessKernel, RenderBehaviour> endless_kernel("render", "endless",
                                                               "the published kernel without termination", false,
                                                               Trust::trusted);
const Registrar<ThresholdKernel, RenderBehaviour> threshold_kernel(
    "render", "threshold", "the published kernel with the hardware's rule: a pixel stops once its alpha is 0.996",
    false, Trust::trusted);
}  // namespace

}  // namespace vrpipe
