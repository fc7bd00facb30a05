#include "raster/raster.h"

#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/slots/raster.h>

namespace vrpipe {

namespace {

/// RASTER without time. Ports as in raster_unit.cpp.
class UntimedRaster : public UntimedUnit {
 public:
  UntimedRaster(const std::string& name, std::unique_ptr<RasterBehaviour> behaviour)
      : UntimedUnit(name, behaviour->time().kinds()),
        out_(*this, "out_quads"),
        in_(input<RasterJob>("in_jobs", [this](const RasterJob& job) { rasterize(job); })),
        in_hi_z_(input<HiZUpdate>("in_hi_z", [this](const HiZUpdate& update) { behaviour_->update(update); })),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()) {
    in_hi_z_->set_optional();
  }

  Behaviour& behaviour() override { return *behaviour_; }

 private:
  void rasterize(const RasterJob& job) {
    if (job.mark != Mark::none) {
      QuadBeat mark;
      mark.mark = job.mark;
      return out_.send(mark);
    }
    did(time_.set_up(job.primitive.draw).work, 1);
    behaviour_->begin(job.primitive, job.clip);
    unsigned tests = 0;
    bool new_screen_tile = false;
    while (behaviour_->next(tile_, tests, new_screen_tile)) {
      did(RasterWork::coarse, tests);
      did(RasterWork::fine, 1);
      did(RasterWork::pairs, new_screen_tile ? 1U : 0U);
      did(RasterWork::quads, tile_.count);
      if (tile_.count > 0) out_.send(tile_);
    }
    did(RasterWork::coarse, tests);
  }

  UntimedOut<QuadBeat> out_;
  std::unique_ptr<UntimedIn<RasterJob>> in_;
  std::unique_ptr<UntimedIn<HiZUpdate>> in_hi_z_;
  std::unique_ptr<RasterBehaviour> behaviour_;
  const RasterTime time_;
  QuadBeat tile_;
};

[[maybe_unused]] const bool raster_untimed_registered = [] {
  register_untimed_unit_maker("raster", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                           const RenderContext&, unsigned) {
    return std::make_unique<UntimedRaster>(name, behaviour_as<RasterBehaviour>(std::move(behaviour)));
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
