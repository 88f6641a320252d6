#include "host/output/report/view.hpp"

#include <algorithm>
#include <limits>

#include "host/engine/estimation/balance_fit.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/modelled_torque.hpp"

namespace flexspline::report {
namespace {

using estimation::Balance;

model::Model reconciled(const model::Model& model, const data::Dataset& dataset) {
  comparison::require_values(model);
  std::vector<std::string> warned_already;
  model::Model result = model;
  result.drive = estimation::reconcile(model.drive, dataset, warned_already);
  return result;
}

std::shared_ptr<const estimation::PreparedData> records_for(const Subject& subject, const model::Model& model) {
  const estimation::Terms terms = estimation::terms_of(model);
  if (subject.pipeline.ready && !estimation::reads_torque(terms)) return subject.pipeline.ready;
  const auto records =
      std::make_shared<estimation::PreparedData>(estimation::prepare_all(*subject.dataset, model, subject.pipeline));
  estimation::take_torque_where_read(*records, terms);
  return records;
}

}  // namespace

View::View(const Subject& subject)
    : dataset(*subject.dataset),
      model(reconciled(subject.model, dataset)),
      model_before(subject.before),
      ready(records_for(subject, model)),
      prepared(*ready) {
  estimation::PipelineOptions pipeline = subject.pipeline;
  pipeline.ready = ready;
  comparison = comparison::compare(dataset, model, pipeline, subject.baselines, subject.extent);
  terms = estimation::terms_of(model);
  if (model_before) {
    model_before->drive = model.drive;
    comparison_before = comparison::compare(dataset, *model_before, pipeline, {}, subject.extent);
    terms_before = estimation::terms_of(*model_before);
  }
  for (const Balance balance : {Balance::motor, Balance::transmission, Balance::load}) {
    const std::string signal(selection::balance_signal(balance));
    const comparison::SignalResult* overall = comparison.find_overall(signal);
    if (!overall) continue;
    BalanceView view;
    view.balance = balance;
    view.signal = signal;
    view.unit = overall->unit;
    balances.push_back(std::move(view));
  }
  estimation::in_parallel(balances.size(), [&](std::size_t b) {
    BalanceView& view = balances[b];
    view.data = std::make_unique<estimation::RegressionProblem>(prepared, view.balance);
    view.residual = view.data->residual(terms);
    if (terms_before) view.before = view.data->residual(*terms_before);
    view.floor_squared = Eigen::VectorXd::Constant(view.data->rows(), std::numeric_limits<double>::quiet_NaN());
    for (const estimation::RowRange& range : view.data->records())
      if (const auto* r = result(range.record, view.signal); r && r->noise_floor)
        view.floor_squared.segment(range.first, range.size()).setConstant(*r->noise_floor * *r->noise_floor);
    view.filter_time = view.data->filter_autocorrelation_time();
    view.autocorrelation_time =
        std::max(view.filter_time, estimation::autocorrelation_time(view.data->records(), shown(view)));
  });
}

const comparison::SignalResult* View::result(std::size_t record, const std::string& signal) const {
  for (const comparison::SignalResult& s : comparison.experiments[record].signals)
    if (s.signal == signal) return &s;
  return nullptr;
}

}  // namespace flexspline::report
