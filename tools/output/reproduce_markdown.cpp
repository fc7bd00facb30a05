#include "output/reproduce_markdown.h"

#include <cstddef>

#include <fmt/format.h>

#include <vrpipe/component/printable.h>

#include "output/reproduce_answers.h"

namespace vrpipe::tools {
namespace {

std::string markdown_row(const std::vector<std::string>& cells) {
  std::string line = "|";
  for (const std::string& cell : cells) {
    line += ' ';
    for (const char c : cell) line += c == '|' ? std::string("\\|") : std::string(1, c);
    line += " |";
  }
  return line + "\n";
}

std::string table_markdown(const std::vector<std::string>& heading, const std::vector<std::vector<std::string>>& rows) {
  std::string text = markdown_row(heading) + "|";
  for (std::size_t i = 0; i < heading.size(); ++i) text += "---|";
  text += "\n";
  for (const auto& row : rows) text += markdown_row(row);
  return text + "\n";
}

}  // namespace

std::string reproduction_markdown(const Reproduction& of) {
  std::string command = "build/bin/vrpipe reproduce";
  if (of.result.plan.quick) command += " --quick";
  for (const SceneFinding& scene : of.findings.beside) {
    const PlannedScene& planned = of.result.plan.scenes[scene.scene];
    command += " --beside " + planned.name + "=" + printable(planned.request);
  }
  std::string text =
      "# The paper's results, reproduced\n\n"
      "Written by one command, on an unloaded machine of two cores in half an hour; do not edit:\n\n"
      "<!-- not run: takes half an hour -->\n"
      "```console\n$ " +
      command +
      " --markdown docs/reproduction.md\n```\n\n"
      "`--quick` takes less than three minutes, `--html FILE` writes a page with plots and heat maps, `--scene "
      "train=FILE` takes a\n"
      "trained model, `--beside NAME=FILE` shows a scene of yours beside the paper's. What was done of an interrupted "
      "run is not done again. The rows are\n"
      "[a file](../tools/jobs/paper_rows.toml): what the paper says and where, how it is measured and judged here, and "
      "what may explain\n"
      "a difference; `--rows FILE` takes one of yours.\n\n";
  for (const std::string& line : reproduction_heading(of)) text += "* " + line + "\n";
  text += "\n**" + verdict_summary(of) + ".**\n\n## Row by row\n\n";
  std::vector<std::vector<std::string>> rows;
  for (const RowFinding& finding : of.rows) {
    const PaperRow& row = *finding.row;
    rows.push_back({row.id, row.what, row.section, row.says, finding.measured, difference_text(finding),
                    verdict_text(of, finding), why_text(finding)});
  }
  text += table_markdown({"id", "what", "section of the paper", "the paper says", "measured here", "difference",
                          "verdict", "why, or how measured"},
                         rows);
  for (const ReportTable& table : all_tables(of)) {
    text += "## " + table.title + "\n\n" + table_markdown(table.heading, table.rows);
    if (!table.note.empty()) text += table.note + "\n\n";
  }
  text += "## The two riddles\n\n";
  for (const Answer& answer : answers(of)) text += "**" + answer.question + "** " + answer.text + "\n\n";
  if (!of.result.plan.skipped.empty()) {
    text += "## Not tried\n\n";
    for (const SkippedSetting& skipped : of.result.plan.skipped) {
      text += fmt::format("* `{}`: {}\n", skipped.settings, skipped.reason);
    }
    text += "\n";
  }
  text +=
      "## JSON\n\n"
      "`--json` has the schema `vrpipe.reproduce/1`. Nothing in it depends on the host, or on how often a run was "
      "interrupted.\n\n"
      "| key | holds |\n|---|---|\n"
      "| `schema`, `version`, `command`, `quick`, `platform`, `fidelity`, `format`, `simulations` | what was run |\n"
      "| `rows` | of each row `id`, `what`, `section`, `paper`, `paper_number`, `tolerance_percent`, `how`, "
      "`measured`, `measured_number`, `difference_percent`, `verdict`, `reason`, `tried`: of each reason its text, "
      "`setting`, `measure` or `row`, what was `measured` with it and whether it `is_shown`; null where there is "
      "none |\n"
      "| `scenes`, `large_scenes`, `scenes_beside` | `runs` of the four variants with counts, utilisation and "
      "bottleneck; speed-ups; of "
      "the six "
      "also ratios by view, fragments a pixel, passes and `whole_frame`: what is before a draw, in software and by "
      "GSCore |\n"
      "| `sensitivity` | `parameters`, the greatest spread first, `checks`, `not_tried` |\n"
      "| `front_ends` | of each its `rows`, how many `agree`, and `means` over the six scenes |\n"
      "| `main`, `efficiency`, `fragments_per_quad`, `answers` | of the riddles |\n"
      "| `microbenchmarks` | figures of each |\n\n";
  while (text.size() > 1 && text[text.size() - 2] == '\n') text.pop_back();
  return text;
}

}  // namespace vrpipe::tools
