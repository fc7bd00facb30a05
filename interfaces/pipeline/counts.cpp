#include <vrpipe/pipeline/counts.h>

namespace vrpipe {

const std::vector<CountField>& Counts::fields() {
  constexpr bool shared = true, rare = true;
  static const std::vector<CountField> all{{"primitives", &Counts::primitives},
                                           {"quads_rasterized", &Counts::quads_rasterized},
                                           {"fragments_rasterized", &Counts::fragments_rasterized},
                                           {"quads_depth_stencil_failed", &Counts::quads_depth_stencil_failed},
                                           {"fragments_depth_stencil_failed", &Counts::fragments_depth_stencil_failed},
                                           {"quads_terminated", &Counts::quads_terminated},
                                           {"fragments_terminated", &Counts::fragments_terminated},
                                           {"quads_unshaded", &Counts::quads_unshaded, !shared, rare},
                                           {"fragments_unshaded", &Counts::fragments_unshaded, !shared, rare},
                                           {"quads_shaded", &Counts::quads_shaded},
                                           {"fragments_shaded", &Counts::fragments_shaded},
                                           {"quads_pruned", &Counts::quads_pruned},
                                           {"fragments_pruned", &Counts::fragments_pruned},
                                           {"quads_merged", &Counts::quads_merged},
                                           {"fragments_merged", &Counts::fragments_merged},
                                           {"quads_dropped_late", &Counts::quads_dropped_late},
                                           {"fragments_dropped_late", &Counts::fragments_dropped_late},
                                           {"quads_late_failed", &Counts::quads_late_failed},
                                           {"fragments_late_failed", &Counts::fragments_late_failed},
                                           {"quads_unblended", &Counts::quads_unblended, !shared, rare},
                                           {"fragments_unblended", &Counts::fragments_unblended, !shared, rare},
                                           {"quads_blended", &Counts::quads_blended},
                                           {"fragments_blended", &Counts::fragments_blended},
                                           {"warps", &Counts::warps, shared},
                                           {"tgc_flushes", &Counts::tgc_flushes, shared},
                                           {"tc_flushes", &Counts::tc_flushes, shared},
                                           {"termination_updates", &Counts::termination_updates}};
  return all;
}

std::vector<std::pair<std::string, std::uint64_t>> Counts::named() const {
  std::vector<std::pair<std::string, std::uint64_t>> named;
  for (const CountField& field : fields()) named.emplace_back(field.name, this->*field.value);
  return named;
}

}  // namespace vrpipe
