#include "jobs/precision_knobs.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include <vrpipe/platforms/configuration.h>
#include <vrpipe/workloads/preprocess_parameters.h>

namespace vrpipe::tools {
namespace {

std::string parameter_value(const ParameterSet& set, const std::string& name) {
  for (const Parameter* parameter : set.parameters()) {
    if (name == parameter->name()) return parameter->value();
  }
  throw std::logic_error("there is no parameter " + name);
}

/// A parameter of the draw's state.
PrecisionKnob state_knob(const std::string& name, const std::string& meaning, std::vector<std::string> values,
                         const std::string& quick_value) {
  PrecisionKnob knob{name, "--set state." + name + "=", meaning, std::move(values), quick_value, false, {}, {}};
  knob.value = [name](const PrecisionSettings& settings) {
    StateParameters state;
    for (const auto* list : {&settings.request.platform->settings, &settings.request.settings}) {
      for (const Setting& setting : *list) {
        if (setting.unit == "state") state.set(setting.unit, setting.parameter, setting.value);
      }
    }
    return parameter_value(state, name);
  };
  knob.set = [name](PrecisionSettings& settings, const std::string& value) {
    settings.request.settings.push_back({"state", name, value});
  };
  return knob;
}

PrecisionKnob preprocess_knob(const std::string& name, const std::string& meaning, std::vector<std::string> values,
                              const std::string& quick_value, int PreprocessOptions::*member) {
  PrecisionKnob knob{name, "--set preprocess." + name + "=", meaning, std::move(values), quick_value, true, {}, {}};
  knob.value = [member](const PrecisionSettings& settings) { return std::to_string(settings.preprocess.*member); };
  knob.set = [name, member](PrecisionSettings& settings, const std::string& value) {
    PreprocessParameters parameters;
    parameters.set(name, value);
    settings.preprocess.*member = parameters.options().*member;
  };
  return knob;
}

/// An extension of the paper: another variant.
PrecisionKnob variant_knob(const std::string& name, const std::string& meaning, bool Variant::*member) {
  PrecisionKnob knob{name, "--variant ", meaning, {"on", "off"}, "off", false, {}, {}};
  knob.value = [member](const PrecisionSettings& settings) {
    return settings.request.variant.*member ? std::string("on") : std::string("off");
  };
  knob.set = [member](PrecisionSettings& settings, const std::string& value) {
    Variant wanted = settings.request.variant;
    wanted.*member = value == "on";
    for (const Variant& variant : variants()) {
      if (variant.is_of_pipeline() && variant.quad_merging == wanted.quad_merging &&
          variant.early_termination == wanted.early_termination) {
        settings.request.variant = variant;
      }
    }
  };
  return knob;
}

std::string level(int n) { return fmt::format("{}", n / 255.0); }

std::vector<PrecisionKnob> make_knobs() {
  std::vector<PrecisionKnob> knobs;
  knobs.push_back({"format",
                   "--format ",
                   "what the colour target stores per channel",
                   {"rgba8", "srgb8", "rgba16f", "rgba16", "rgba32f"},
                   "rgba8",
                   false,
                   [](const PrecisionSettings& settings) { return vrpipe::name_of(settings.request.format); },
                   [](PrecisionSettings& settings, const std::string& value) {
                     settings.request.format = color_format_named(value);
                   }});
  knobs.push_back(
      state_knob("blend_rounding", "how the blender rounds to the format", {"rne", "rtz", "measured"}, "rtz"));
  knobs.push_back(state_knob("termination_threshold", "alpha at which a pixel is terminated",
                             {"0.98", "0.99", "0.996", "0.999"}, "0.98"));
  knobs.push_back(state_knob("termination_compare", "how alpha passes that threshold", {"ge", "gt"}, ""));
  knobs.push_back({"termination",
                   "--termination ",
                   "when a termination bit counts",
                   {"paper", "strict"},
                   "",
                   false,
                   [](const PrecisionSettings& settings) { return name_of(settings.request.termination); },
                   [](PrecisionSettings& settings, const std::string& value) {
                     settings.request.termination = termination_named(value);
                   }});
  knobs.push_back(state_knob("pruning_threshold", "alpha below which a fragment is not blended",
                             {"0", level(1), level(2), level(4)}, level(4)));
  knobs.push_back(state_knob("subpixel_bits", "of vertex coordinates", {"4", "8", "12"}, ""));
  knobs.push_back(
      state_knob("exponential", "of the fragment shader", {"exact", "ex2", "fp16", "table256", "table16"}, "table16"));
  knobs.push_back(state_knob("shading", "arithmetic of alpha and colour in the shader", {"fp32", "fp16"}, "fp16"));
  knobs.push_back(state_knob("merging", "arithmetic of QM's merge", {"fp32", "fp16"}, ""));
  knobs.push_back(state_knob("attributes", "format of what the shader loads of a splat", {"fp32", "fp16", "quantized"},
                             "quantized"));
  knobs.push_back(state_knob("export_format", "format of what the shader sends to CROP", {"fp32", "fp16"}, ""));
  knobs.push_back(state_knob("alpha_max", "that the shader clamps alpha to", {"0.99", "0.999", "1"}, ""));
  knobs.push_back(preprocess_knob("depth_key_bits", "of the depths that splats are sorted by", {"32", "24", "16", "12"},
                                  "12", &PreprocessOptions::depth_key_bits));
  knobs.push_back(preprocess_knob("sh_degree", "highest degree of spherical harmonics evaluated", {"3", "2", "1", "0"},
                                  "0", &PreprocessOptions::sh_degree));
  knobs.push_back({"dilation",
                   "--set preprocess.dilation=",
                   "of projected covariances, pixels^2",
                   {"0.1", "0.3", "0.5"},
                   "",
                   true,
                   [](const PrecisionSettings& settings) { return fmt::format("{}", settings.preprocess.dilation); },
                   [](PrecisionSettings& settings, const std::string& value) {
                     PreprocessParameters parameters;
                     parameters.set("dilation", value);
                     settings.preprocess.dilation = parameters.options().dilation;
                   }});
  knobs.push_back(state_knob("splat_extent", "what is rasterised for a splat", {"obb", "aabb", "three_sigma"}, ""));
  knobs.push_back(variant_knob("quad_merging", "TGC and QRU merge overlapping quads", &Variant::quad_merging));
  knobs.push_back(
      variant_knob("early_termination", "ZROP and CROP terminate opaque pixels", &Variant::early_termination));
  // The same rates, latencies and instructions whatever they are set to; and preprocessing is before the draw.
  const std::vector<std::string> free{
      "blend_rounding", "termination_compare", "subpixel_bits",  "exponential", "shading", "merging",
      "export_format",  "alpha_max",           "depth_key_bits", "sh_degree",   "dilation"};
  for (PrecisionKnob& knob : knobs) knob.is_of_pipeline = !knob.is_preprocessing && knob.name != "pruning_threshold";
  for (PrecisionKnob& knob : knobs) knob.is_charged = std::find(free.begin(), free.end(), knob.name) == free.end();
  return knobs;
}

}  // namespace

const std::vector<PrecisionKnob>& precision_knobs() {
  static const std::vector<PrecisionKnob> knobs = make_knobs();
  return knobs;
}

const std::vector<std::vector<std::pair<std::string, std::string>>>& precision_crossings() {
  static const auto crossings = [] {
    std::vector<std::vector<std::pair<std::string, std::string>>> all;
    for (const char* format : {"rgba8", "rgba16f"}) {
      for (const char* rounding : {"rne", "rtz"}) {
        const auto add = [&](const char* merged, const char* merging) {
          all.push_back(
              {{"format", format}, {"blend_rounding", rounding}, {"quad_merging", merged}, {"merging", merging}});
        };
        add("off", "fp32");
        add("on", "fp32");
        add("on", "fp16");
      }
    }
    return all;
  }();
  return crossings;
}

bool can_round(const PrecisionSettings& settings) {
  return can_round(settings.request.format, device_precision_of(settings.request).blend_rounding);
}

std::optional<DrawnPrecision> drawn_precision(const RunRequest& request) {
  const DrawState state = draw_state_of(request);
  const double visible = 1.0 / 255.0;
  const bool is_cut = state.obb_padding < 0.7072F || state.obb_padding > 1.0F;
  // Without pruning a larger box has more fragments.
  const bool is_wider =
      state.splat_extent != SplatExtent::oriented_box && static_cast<double>(state.pruning_threshold) < 0.999 * visible;
  if (is_cut || is_wider || !request.units.empty() || !request.variant.is_of_pipeline() ||
      !request.variant.changed_units.empty()) {
    return std::nullopt;
  }
  DrawnPrecision drawn;
  drawn.format = request.format;
  drawn.device = device_precision_of(request);
  drawn.merges = request.variant.quad_merging;
  drawn.pruning_threshold = static_cast<double>(state.pruning_threshold);
  if (state.splat_extent == SplatExtent::three_sigma) drawn.sigmas_covered = 3;
  if (request.variant.early_termination) drawn.termination_threshold = static_cast<double>(state.termination_threshold);
  return drawn;
}

std::string readable_value(const PrecisionKnob& knob, const std::string& value) {
  if (knob.name != "pruning_threshold") return value;
  for (int n = 1; n < 255; ++n) {
    if (value == level(n)) return fmt::format("{}/255", n);
  }
  return value;
}

}  // namespace vrpipe::tools
