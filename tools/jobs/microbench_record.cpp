#include "jobs/microbench_record.h"

#include <optional>

#include <nlohmann/json.hpp>

namespace vrpipe::tools {
namespace {

using nlohmann::json;

json number(const std::optional<double>& value) { return value ? json(*value) : json(); }
std::optional<double> number(const json& value) {
  return value.is_null() ? std::nullopt : std::optional<double>(value.get<double>());
}

}  // namespace

json to_json(const MicrobenchResult& result) {
  json figures = json::array();
  for (const MicrobenchFigure& figure : result.figures) {
    figures.push_back({{"name", figure.name},
                       {"unit", figure.unit},
                       {"paper", number(figure.paper)},
                       {"gpu", number(figure.gpu)},
                       {"measured", figure.measured},
                       {"tolerance_percent", figure.tolerance_percent},
                       {"note", figure.note},
                       {"gpu_is_of", figure.gpu_is_of},
                       {"reference", number(figure.reference)},
                       {"reference_is", figure.reference_is}});
  }
  return {{"name", result.name}, {"question", result.question}, {"platform", result.platform}, {"figures", figures}};
}

MicrobenchResult microbench_from_json(const json& record) {
  MicrobenchResult result;
  record.at("name").get_to(result.name);
  record.at("question").get_to(result.question);
  record.at("platform").get_to(result.platform);
  for (const json& each : record.at("figures")) {
    MicrobenchFigure figure;
    each.at("name").get_to(figure.name);
    each.at("unit").get_to(figure.unit);
    figure.paper = number(each.at("paper"));
    figure.gpu = number(each.at("gpu"));
    each.at("measured").get_to(figure.measured);
    each.at("tolerance_percent").get_to(figure.tolerance_percent);
    each.at("note").get_to(figure.note);
    each.at("gpu_is_of").get_to(figure.gpu_is_of);
    figure.reference = number(each.at("reference"));
    each.at("reference_is").get_to(figure.reference_is);
    result.figures.push_back(std::move(figure));
  }
  return result;
}

}  // namespace vrpipe::tools
