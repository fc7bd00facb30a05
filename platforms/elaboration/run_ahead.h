#pragma once

#include <memory>
#include <string>
#include <vector>

#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/slots/tc.h>
#include <vrpipe/pipeline/slots/zrop.h>
#include <vrpipe/platforms/configuration.h>

namespace vrpipe {

class CropBehaviour;
class SmBehaviour;

/// Strict termination where there is time: what comes behind ZROP in a GPC, elaborated without time. It takes each bin
/// as it is tested, in order, through merging, shading, late tests and blending, and knows what that terminates before the
/// next bin is tested, whenever the timing models get there. They get units that repeat what has been done here.
class RunAhead final : public FunctionalRunAhead {
 public:
  /// Makes units of the GPC; CROP blends into the surface. Throws UserError where no way leads from PROP to CROP.
  RunAhead(const Configuration& configuration, unsigned gpc, ColorSurface& surface);
  ~RunAhead() override;

  void pass(Mark mark) override;
  void tested(const QuadBeat& survivors, std::vector<TerminationSignal>& terminated) override;

  /// For the timing model of the GPC's SM array or CROP: gives each warp the outcome that it had here.
  std::unique_ptr<Behaviour> make_repeating(const std::string& slot);
  /// The same for that of ZROP, where draws are tested late: gives each warp what its test left here. It keeps ZROP, whose late
  /// tests are called here from now on.
  std::unique_ptr<Behaviour> repeat_late_tests(std::unique_ptr<Behaviour> zrop);
  /// The unit proper, whose counters count: of the SM array or CROP.
  Behaviour& unit(const std::string& slot);

 private:
  class Record;
  class RecordingSm;
  class RepeatingSm;
  class RecordingCrop;
  class RepeatingCrop;
  class LateTests;
  class RepeatingZrop;
  class Signals;

  std::unique_ptr<Record> record_;
  std::unique_ptr<Signals> signals_;
  std::unique_ptr<LateTests> late_tests_;
  std::vector<std::unique_ptr<UntimedUnit>> units_;
  UntimedIn<BinItem>* entry_ = nullptr;
  SmBehaviour* sm_ = nullptr;
  CropBehaviour* crop_ = nullptr;
  BinStorage bin_;
};

}  // namespace vrpipe
