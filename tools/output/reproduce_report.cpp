#include "output/reproduce_report.h"

#include <cstddef>

#include <fmt/format.h>

#include "output/reproduce_answers.h"
#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

constexpr std::size_t page_width = 80;
constexpr std::size_t table_width = page_width + 20;
/// Of the first line of a row: id, verdict, what the paper says; what was measured follows.
constexpr const char* row_form = "{:4}{:20}{:24}";

std::string indented(const std::string& text, std::size_t indent = 0) {
  std::string lines;
  for (const std::string& line : wrapped(text, page_width - indent)) lines += std::string(indent, ' ') + line + "\n";
  return lines;
}

/// Two lines or more: what was found, and under it what of and why.
std::string row_text(const Reproduction& of, const RowFinding& finding, const TextStyle& style) {
  const PaperRow& row = *finding.row;
  const std::string verdict = fmt::format("{:20}", verdict_text(of, finding));
  std::string text = fmt::format(row_form, row.id,
                                 finding.verdict == Verdict::agrees    ? style.good(verdict)
                                 : finding.verdict == Verdict::differs ? style.bold(verdict)
                                                                       : style.dim(verdict),
                                 row.says);
  const std::string measured = finding.measured.empty() ? "-" : finding.measured;
  const std::string difference = difference_text(finding);
  const std::size_t before = fmt::formatted_size(row_form, "", "", "");
  const bool is_short = measured.size() + 2 + difference.size() <= table_width - before;
  text += (is_short ? measured + (difference.empty() ? "" : ", " + difference) : difference) + "\n";
  constexpr std::size_t indent = 4;
  text += style.dim(indented(fmt::format("{}; paper {}", row.what, row.section), indent));
  if (!is_short) text += indented(measured, indent);
  if (!finding.reason.empty()) text += indented(finding.reason, indent);
  return text;
}

std::string table_text(const ReportTable& table, const TextStyle& style) {
  TextTable text(table.heading);
  const bool has_words = table.heading.back() == "values";
  for (const auto& row : table.rows) text.row(row);
  if (has_words) {
    text.left(table.heading.size() - 1);
    text.wrap(table_width);
  }
  std::string all = style.bold(table.title) + "\n" + text.text(style);
  if (!table.note.empty()) all += indented(table.note);
  return all;
}

}  // namespace

std::string reproduction_text(const Reproduction& of, const TextStyle& style) {
  std::string text = style.bold("The paper's results, reproduced") + "\n";
  for (const std::string& line : reproduction_heading(of)) text += indented(line);
  text += "\n";
  text += style.bold(fmt::format(row_form, "id", "verdict", "the paper says") + "measured here, difference") + "\n";
  text +=
      style.dim("    what of; section of the paper; what was measured if it is long; why it differs or is not judged") +
      "\n\n";
  for (const RowFinding& row : of.rows) text += row_text(of, row, style);
  text += "\n" + style.bold(verdict_summary(of)) + "\n";
  for (const ReportTable& table : all_tables(of)) text += "\n" + table_text(table, style);
  for (const Answer& answer : answers(of)) {
    text += "\n" + style.bold(answer.question) + "\n" + indented(answer.text);
  }
  for (const SkippedSetting& skipped : of.result.plan.skipped) {
    text += indented(fmt::format("not tried: {}: {}", skipped.settings, skipped.reason));
  }
  return text;
}

}  // namespace vrpipe::tools
