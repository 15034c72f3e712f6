#pragma once

#include <functional>
#include <string>
#include <vector>

#include "problems/scene.h"

namespace ricochet {

/// The formulas of an AssembledProblem: the same parts, in symbols,
///
///     M = diag(m),   f_v = f,   f_c^i(q) = f_c(q at the coordinates of contact i),   V = -f' q               (1)
class AssembledModel {
 public:
  /// A kind of contact, that of a small scene.
  class Kind {
   public:
    Kind() = default;

   private:
    friend class AssembledModel;
    /// The contact in terms of the coordinates of the small scene.
    std::function<SymbolicModel::Contact(const SymbolicModel::Expressions& q)> contact_at_;
  };

  AssembledModel(const SceneText& text, const GiNaC::ex& end_time);

  // As those of AssembledProblem.
  int add_coordinate(const GiNaC::ex& m, const GiNaC::ex& f, const GiNaC::ex& q0, const GiNaC::ex& v0);
  template <template <class> class Scene>
  Kind add_kind(const Scene<GiNaC::ex>& scene) {
    Kind kind;
    kind.contact_at_ = [scene](const SymbolicModel::Expressions& q) { return contact_at(scene, q); };
    return kind;
  }
  int add_contact(const Kind& kind, const std::vector<int>& coordinates, std::string name);
  void set_geometry(GeometryOf<GiNaC::ex> geometry) { model_.geometry = std::move(geometry); }
  void set_impact_law(ImpactLaw law) { model_.impact_law = std::move(law); }

  /// The model, without the parameters. To be called last.
  SymbolicModel finish();

 private:
  template <class Scene>
  static SymbolicModel::Contact contact_at(const Scene& scene, const SymbolicModel::Expressions& q) {
    Vec<GiNaC::ex, scene_detail::n_q<Scene>> local;
    std::ranges::copy(q, local.begin());
    const auto law = scene.contacts()[0];
    SymbolicModel::Contact contact;
    contact.gap = scene.gap(local)[0];
    contact.eps_r = law.eps_r;
    contact.mu = law.mu;
    if constexpr (scene_detail::HasTangents<Scene>) {
      const auto tangents = scene.tangents(local);
      for (const auto& direction : tangents[0]) contact.tangents.emplace_back(direction.begin(), direction.end());
    }
    return contact;
  }

  SymbolicModel model_;
  std::vector<GiNaC::ex> masses_;
  std::vector<std::vector<int>> coordinates_;  ///< of all contacts, whose tangents have these entries until finish()
};

}  // namespace ricochet
