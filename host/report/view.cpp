#include "host/report/view.hpp"

#include <algorithm>
#include <limits>

#include "host/regression/balance_fit.hpp"
#include "host/regression/least_squares.hpp"

namespace flexspline::report {
namespace {

using regression::Balance;

regression::Prepared prepared_as_compared(const data::Dataset& dataset, const model::Model& model,
                                          const comparison::Comparison& comparison) {
  std::vector<const data::Experiment*> all;
  for (const data::Experiment& e : dataset.experiments) all.push_back(&e);
  return regression::prepare_with(all, model.drive, comparison.pipeline);
}

}  // namespace

View::View(const Subject& subject) : dataset(*subject.dataset), model(subject.model), model_before(subject.before) {
  std::vector<std::string> said_already;
  model.drive = regression::reconcile(model.drive, dataset, said_already);
  comparison = comparison::compare(dataset, model, subject.pipeline, subject.beside, subject.free_runs);
  terms = regression::terms_of(model);
  if (model_before) {
    model_before->drive = model.drive;
    comparison_before = comparison::compare(dataset, *model_before, subject.pipeline, {}, subject.free_runs);
    terms_before = regression::terms_of(*model_before);
  }
  prepared = prepared_as_compared(dataset, model, comparison);
  for (const Balance balance : {Balance::motor, Balance::transmission, Balance::load}) {
    const std::string signal(diagnosis::balance_signal(balance));
    const comparison::SignalResult* overall = comparison.find_overall(signal);
    if (!overall) continue;
    BalanceView view;
    view.data = std::make_unique<regression::BalanceData>(prepared, balance);
    view.signal = signal;
    view.unit = overall->unit;
    view.residual = regression::residual_of(*view.data, terms);
    if (terms_before) view.before = regression::residual_of(*view.data, *terms_before);
    view.floor_squared = Eigen::VectorXd::Constant(view.data->rows(), std::numeric_limits<double>::quiet_NaN());
    for (const regression::RowRange& range : view.data->records())
      if (const auto* r = result(range.record, signal); r && r->noise_floor)
        view.floor_squared.segment(range.first, range.size()).setConstant(*r->noise_floor * *r->noise_floor);
    view.filter_time = view.data->filter_autocorrelation_time();
    view.autocorrelation_time =
        std::max(view.filter_time, regression::autocorrelation_time(view.data->records(), shown(view)));
    balances.push_back(std::move(view));
  }
}

const comparison::SignalResult* View::result(std::size_t record, const std::string& signal) const {
  for (const comparison::SignalResult& s : comparison.experiments[record].signals)
    if (s.signal == signal) return &s;
  return nullptr;
}

}  // namespace flexspline::report
