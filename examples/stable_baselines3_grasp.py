"""stable-baselines3: PPO begins to learn to lift objects by touch, straight from an id of gymnasium."""

import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import mjtactile  # registers the environments

env = make_vec_env("mjtactile/GraspLift-v0", n_envs=4, seed=0, env_kwargs={"observation": "readings"})
policy = PPO("MultiInputPolicy", env, n_steps=64, batch_size=128, n_epochs=5, learning_rate=1e-3, seed=0, device="cpu")

print(f"mean reward before learning: {evaluate_policy(policy, env, 20)[0]:.1f}")
policy.learn(2048)
print(f"mean reward after 2,048 steps: {evaluate_policy(policy, env, 20)[0]:.1f}")

# What a policy sees where the hand closes and stays where it is.
env.seed(1)
seen = env.reset()
for _ in range(10):
    seen, *_ = env.step(np.tile([1.0, 0.0], (env.num_envs, 1)))
print(f"observation 'tactile': shape {seen['tactile'].shape}: environments, pads, layers, rows, columns")
left, right = seen["tactile"][0].max(axis=(1, 2, 3))
print(f"highest reading of the left pad {10 * left:.0f} kPa, of the right pad {10 * right:.0f} kPa")

model, data = env.envs[0].unwrapped.task.simulation.state(0)  # MuJoCo's own, of the first environment
print(f"grip on the left pad: {-mjtactile.TactileSensor(model, 'left').wrench(data)[2]:.2f} N")
