#pragma once

#include <string>
#include <vector>

#include "host/terminal.h"
#include "jobs/accuracy_job.h"

namespace vrpipe::tools {

/// A table of the accuracy report, whatever it is printed on.
struct AccuracyTable {
  struct Row {
    std::string group;               ///< what the rows of a group have in common
    std::vector<std::string> cells;  ///< as many as the heading has
    bool marked = false;             ///< dominated, or on the Pareto front
  };
  std::string group_heading;
  std::vector<std::string> heading;
  std::vector<Row> rows;
};
AccuracyTable fidelity_table(const AccuracyResult& result);
/// Errors of the fidelities away from what was asked for.
AccuracyTable stress_table(const AccuracyResult& result);
/// The default once, and below it every other value.
AccuracyTable precision_table(const AccuracyResult& result);

/// Of several values at once.
AccuracyTable crossed_table(const AccuracyResult& result);
std::string crossed_title();
/// Between two near views.
AccuracyTable popping_table(const AccuracyResult& result);
std::string popping_title();
/// Of the default and of every other format: how far pixels with so many fragments are off.
AccuracyTable fragments_table(const AccuracyResult& result);
/// The runs that it has, the default first.
std::vector<const PrecisionRun*> runs_by_fragments(const AccuracyResult& result);
/// What stands above it.
std::string fragments_title();

/// What accuracy costs on the fidelity ladder, in a sentence.
std::string fidelity_verdict(const AccuracyResult& result);
/// The same of the precision ladder; empty without time.
std::string precision_verdict(const AccuracyResult& result);

/// What stands above the stress table: what it departs from.
std::string stress_title(const AccuracyResult& result);
/// What stands below: configurations that were left out, one line each.
std::vector<std::string> stress_notes(const AccuracyResult& result);

// What the words of the tables mean, tolerances included.
std::string fidelity_definition(const AccuracyResult& result);  ///< of "dominated"
std::string precision_definition();                             ///< of "front"

/// The fidelities that the others of a variant are measured against, e.g. "cycle, lt of accelerator".
std::string most_exact_text(const AccuracyResult& result);

/// A bound on an error, percent, rounded up: 0 only for 0.
std::string within(double percent);

/// What the levels of the fidelity ladder are good for, one line each.
std::vector<std::string> fidelity_summary(const AccuracyResult& result);
/// What knobs cost nothing, and what else the precision ladder says; one line each.
std::vector<std::string> precision_summary(const AccuracyResult& result);

/// What was drawn on which GPU, and how, in three lines; then what one has to know to trust the rest, one line each.
std::vector<std::string> accuracy_heading(const AccuracyResult& result);

/// For the terminal.
std::string accuracy_text(const AccuracyResult& result, const TextStyle& style);
/// For the documentation: heading, tables and summaries.
std::string accuracy_markdown(const AccuracyResult& result);

}  // namespace vrpipe::tools
