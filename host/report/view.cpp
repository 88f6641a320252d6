#include "host/report/view.hpp"

#include <algorithm>
#include <limits>

#include "host/regression/balance_fit.hpp"
#include "host/regression/in_parallel.hpp"
#include "host/regression/least_squares.hpp"

namespace flexspline::report {
namespace {

using regression::Balance;

model::Model reconciled(const model::Model& model, const data::Dataset& dataset) {
  comparison::require_values(model);
  std::vector<std::string> said_already;
  model::Model result = model;
  result.drive = regression::reconcile(model.drive, dataset, said_already);
  return result;
}

std::shared_ptr<const regression::Prepared> records_for(const Subject& subject, const model::Drive& drive) {
  if (subject.pipeline.ready) return subject.pipeline.ready;
  return std::make_shared<const regression::Prepared>(
      regression::prepare_all(*subject.dataset, drive, subject.pipeline));
}

}  // namespace

View::View(const Subject& subject)
    : dataset(*subject.dataset),
      model(reconciled(subject.model, dataset)),
      model_before(subject.before),
      ready(records_for(subject, model.drive)),
      prepared(*ready) {
  regression::PipelineOptions pipeline = subject.pipeline;
  pipeline.ready = ready;
  comparison = comparison::compare(dataset, model, pipeline, subject.beside, subject.extent);
  terms = regression::terms_of(model);
  if (model_before) {
    model_before->drive = model.drive;
    comparison_before = comparison::compare(dataset, *model_before, pipeline, {}, subject.extent);
    terms_before = regression::terms_of(*model_before);
  }
  for (const Balance balance : {Balance::motor, Balance::transmission, Balance::load}) {
    const std::string signal(diagnosis::balance_signal(balance));
    const comparison::SignalResult* overall = comparison.find_overall(signal);
    if (!overall) continue;
    BalanceView view;
    view.balance = balance;
    view.signal = signal;
    view.unit = overall->unit;
    balances.push_back(std::move(view));
  }
  regression::in_parallel(balances.size(), [&](std::size_t b) {
    BalanceView& view = balances[b];
    view.data = std::make_unique<regression::BalanceData>(prepared, view.balance);
    view.residual = regression::residual_of(*view.data, terms);
    if (terms_before) view.before = regression::residual_of(*view.data, *terms_before);
    view.floor_squared = Eigen::VectorXd::Constant(view.data->rows(), std::numeric_limits<double>::quiet_NaN());
    for (const regression::RowRange& range : view.data->records())
      if (const auto* r = result(range.record, view.signal); r && r->noise_floor)
        view.floor_squared.segment(range.first, range.size()).setConstant(*r->noise_floor * *r->noise_floor);
    view.filter_time = view.data->filter_autocorrelation_time();
    view.autocorrelation_time =
        std::max(view.filter_time, regression::autocorrelation_time(view.data->records(), shown(view)));
  });
}

const comparison::SignalResult* View::result(std::size_t record, const std::string& signal) const {
  for (const comparison::SignalResult& s : comparison.experiments[record].signals)
    if (s.signal == signal) return &s;
  return nullptr;
}

}  // namespace flexspline::report
