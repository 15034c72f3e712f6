# %% What coarse steps do to two balls on a spring: python3 coarse_steps.py [FIGURE]
# Time stepping moves the impacts to its grid; FESD-J has boundaries of elements there, with the same number of steps.
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

import ricochet  # noqa: E402

SCENE, STEPS = "two_balls_spring", 100

# %% The motion between the steps, and the error of the final state.
methods = {"event-driven, tolerance 1e-10": ("event_driven", {"tolerance": 1e-10}),
           f"FESD-J, Gauss 4, N = {STEPS}": ("fesd:gauss:4,elements=as_needed", {"steps": STEPS}),
           f"Moreau-Jean, N = {STEPS}": ("moreau_jean", {"steps": STEPS})}
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
for (name, (method, setting)), style in zip(methods.items(), ("k-", "C0--", "C1:")):
    run = ricochet.run(SCENE, method, **setting)
    motion = ricochet.motion(SCENE, method, **setting)
    axes.plot(motion["t"], motion["q[0]"], style, label=f"{name}: E(T) = {run.error:.1e}")

# %% The figure.
axes.set(title="Two balls joined by a spring: the lower one", xlabel="t [s]", ylabel="height [m]")
axes.legend()
target = sys.argv[1] if len(sys.argv) > 1 else "coarse_steps.png"
figure.savefig(target, dpi=120)
print(f"figure: {target}")
