#include "output/microbench_json.h"

#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>

namespace vrpipe::tools {

namespace {

Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(); }
Json measured_json(const std::optional<double>& value) { return value ? number_json(*value) : Json(); }

Json points_json(const MicrobenchPoints& points) {
  Json json = Json::array();
  for (const auto& [x, y] : points) json.push_back({number_json(x), number_json(y)});
  return json;
}

Json chosen_units_json(const RunRequest& request) {
  Json json = Json::object();
  for (const UnitChoice& unit : request.units) json[unit.slot] = unit.implementation;
  return json;
}

Json figure_json(const MicrobenchFigure& figure) {
  return {{"name", figure.name},
          {"group", figure.group.empty() ? Json() : Json(figure.group)},
          {"unit", figure.unit},
          {"paper", measured_json(figure.paper)},
          {"gpu", measured_json(figure.gpu)},
          {"gpu_is_of", figure.gpu_is_of.empty() ? Json() : Json(figure.gpu_is_of)},
          {"measured", number_json(figure.measured)},
          {"reference", measured_json(figure.reference)},
          {"reference_is", figure.reference ? Json(figure.reference_is) : Json()},
          {"difference_percent", measured_json(figure.difference_percent())},
          {"tolerance_percent", figure.tolerance_percent < 0 ? Json() : Json(figure.tolerance_percent)},
          {"agrees", figure.reference && figure.tolerance_percent >= 0 ? Json(figure.agrees()) : Json()},
          {"note", figure.note},
          {"source", figure.source},
          {"finding", finding(figure)}};
}

Json group_json(const MicrobenchGroup& group) {
  return {{"name", group.name},
          {"figures", group.figures},
          {"mean_percent", number_json(group.mean_percent)},
          {"worst_percent", number_json(group.worst_percent)},
          {"worst", group.worst}};
}

Json curve_json(const MicrobenchCurve& curve) {
  return {{"name", curve.name},
          {"x_label", curve.x_label},
          {"y_label", curve.y_label},
          {"measured", points_json(curve.measured)},
          {"gpu", points_json(curve.gpu)},
          {"paper", points_json(curve.paper)}};
}

}  // namespace

Json microbench_json(const MicrobenchRun& run) {
  Json json = head_json("vrpipe.microbench/1", run.provenance, run.processes);
  RunResult machine;
  machine.request = run.request;
  machine.parameters = run.results.front().parameters;
  json["platform"] = platform_json({machine}, {}, run.provenance);
  json["units"] = chosen_units_json(run.request);
  json["fidelity"] = fidelity_of(run.request);
  json["microbenchmarks"] = Json::array();
  for (const MicrobenchResult& result : run.results) {
    Json figures = Json::array();
    for (const MicrobenchFigure& figure : result.figures) figures.push_back(figure_json(figure));
    Json groups = Json::array();
    for (const MicrobenchGroup& group : result.groups()) groups.push_back(group_json(group));
    Json curves = Json::array();
    for (const MicrobenchCurve& curve : result.curves) curves.push_back(curve_json(curve));
    json["microbenchmarks"].push_back({{"name", result.name},
                                       {"question", result.question},
                                       {"platform", result.platform},
                                       {"seconds", result.seconds},
                                       {"figures", std::move(figures)},
                                       {"groups", std::move(groups)},
                                       {"curves", std::move(curves)}});
  }
  return json;
}

}  // namespace vrpipe::tools
