// Effects that scale friction by a recorded signal which hardly changes within a record, as temperature does. Blocks of
// a record show nothing of them, so that halves of the data do not say whether chance did it: as many records count as
// there are.
#pragma once

#include <memory>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// The model fitted on all records, those held out among them: of a few records each one counts.
struct AllRecords {
  data::Dataset dataset;  // which `fitted` points into
  std::unique_ptr<estimation::Identification> fitted;
};
// Null where nothing is held out, or no candidate scales friction.
std::unique_ptr<AllRecords> fit_all_records(const SearchedBalance& motor, const data::Dataset& dataset,
                                            const model::Model& model, estimation::PipelineOptions pipeline);

// By chance, where all of a likelihood ratio (twice the logarithm) is how the friction of so many records goes with one
// signal: Student's t of a line through them, as n ln(1 + t^2 / (n - 2)) is its likelihood ratio. One for fewer than
// three.
double p_value_of_likelihood(double likelihood_ratio, std::size_t records);

// Names the effect with which the records' friction goes, behind what is named already (meta-regression to first order,
// Student's t by Knapp and Hartung 2003, times the effects that were tried), or lists it as possible. Where too few
// records identify a friction of their own, the likelihood of all data decides, if nothing is named. Returns whether
// one is named. `base`: the model fitted on the records that count.
bool name_scaling(const estimation::Identification& base, const SearchedBalance& motor, Diagnosis& result);

// Whether the records show such an effect that halves of the data chose. Of fewer records than a test needs, held-out
// experiments may confirm it instead; of more, these are few and go with any drift of the friction by chance.
bool is_shown_between_records(std::size_t records, double p_value, bool held_out_confirms);

// Takes back what halves of the data chose and the records do not show, and lists it as possible.
void take_back_unconfirmed_scaling(const estimation::Identification& base, const SearchedBalance& motor,
                                   Diagnosis& result);

}  // namespace flexspline::selection
