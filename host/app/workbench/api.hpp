// The requests of the page and their answers, without any socket.
#pragma once

#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "host/app/workbench/closed_loop_run.hpp"
#include "host/app/workbench/live_drive.hpp"
#include "host/app/workbench/project.hpp"
#include "host/app/workbench/session.hpp"
#include "host/app/workbench/supervisor.hpp"
#include "host/common/system/temporary_folder.hpp"

namespace flexspline::workbench {

struct Upload {
  std::string name;
  std::string content;
};

// A request that passed access control.
struct Request {
  std::string method;  // "GET", "POST"
  std::string path;    // behind the token: "/api/state"
  std::map<std::string, std::string> query;
  std::string body;
  std::vector<Upload> files;
};

struct Answer {
  int status = 200;
  std::string type = "application/json";
  std::string body;
  std::string download;  // file name for a download; empty: to be shown
};

// What the workbench was started with.
struct Setup {
  std::shared_ptr<Step> first;              // null: there is no model yet
  std::vector<std::filesystem::path> data;  // recordings to begin with where there is no model
  Projects projects;                        // empty functions: without a model there is nothing to do
  std::string data_name;                    // as the user named the data
  std::string model_name;                   // likewise
  std::filesystem::path folder;             // where models, reports and blocks are saved
  estimation::PipelineOptions pipeline;
  std::string drive;                             // --drive; empty: none
  std::optional<drive::PairingSigner> signer{};  // --pairing-key
  SimulatedPlant plant_setup;                    // for closed loops; none known: the present model
  closed_loop::Runner run;                       // of closed loops; empty: there are none
  // Data that outlive a worker process: its jobs, a folder for dropped files and tabs, the failures of earlier workers.
  // Without these all of it ends with the Api.
  JobTable* jobs = nullptr;
  JobLimits limits;
  std::filesystem::path scratch;
  std::vector<Failure> failures;
};

class Api {
 public:
  explicit Api(Setup setup);
  ~Api();

  // Never throws: errors become answers with {"what"} and a status.
  Answer answer(const Request& request);

 private:
  nlohmann::json get(const Request& request);
  nlohmann::json post(const Request& request);
  Answer file(const Request& request);
  nlohmann::json act(const std::shared_ptr<Session>& session, const nlohmann::json& body);
  // Each returns false where it knows no such action.
  bool act_on_project(const std::shared_ptr<Session>& session, const std::string& what, const nlohmann::json& body);
  bool act_on_model(const std::shared_ptr<Session>& session, const std::string& what, const nlohmann::json& body);
  bool act_on_drive(const std::shared_ptr<Session>& session, const std::string& what, const nlohmann::json& body);
  void start_step(const std::shared_ptr<Session>& session, const std::string& what,
                  std::function<std::shared_ptr<Step>(const Step&, const Progress&)> make);
  void start_diagnosis(const std::shared_ptr<Session>& session);
  void start_pack(const std::shared_ptr<Session>& session);
  void start_trial(const std::shared_ptr<Session>& session, const std::string& scenario);
  void start_save(const std::shared_ptr<Session>& session, const nlohmann::json& body);
  void start_drop(const std::shared_ptr<Session>& session, const std::vector<Upload>& files);
  // Of the recordings that were dropped last, or that the workbench was started with.
  void start_proposal(const std::shared_ptr<Session>& session, const nlohmann::json& body);
  void start_project(const std::shared_ptr<Session>& session, const Choices& choices);
  std::vector<std::filesystem::path> recordings_for(const std::filesystem::path& folder) const;
  std::filesystem::path new_folder();
  std::string content(const Session& session, const std::string& what) const;
  std::shared_ptr<Session> session_of(const Request& request);
  std::shared_ptr<Session> open_tab(const std::string& like);
  void store_all_tabs();
  void restore_tabs();
  void refuse_deadly_job(const std::string& key) const;

  Setup setup_;
  std::unique_ptr<const system::TemporaryFolder> own_folder_;  // where none was given
  std::filesystem::path dropped_;                              // folder of dropped files; ends with the workbench
  LiveDrive drive_;
  std::mutex mutex_;
  std::list<std::shared_ptr<Session>> tabs_;  // latest used first
  std::size_t drops_ = 0;
  std::map<std::string, std::string> deadly_;  // keys of jobs that ended a worker, and how
};

}  // namespace flexspline::workbench
