"""stable-baselines3: PPO learns to lift objects by touch, straight from gymnasium.make."""

import gymnasium
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import mjtactile  # registers the environments

env = make_vec_env("mjtactile/GraspLift-v0", n_envs=4, seed=0, env_kwargs={"observation": "wrench"})
policy = PPO("MultiInputPolicy", env, n_steps=64, batch_size=64, learning_rate=1e-3, seed=0, device="cpu")
import time
t=time.time()
print("before", evaluate_policy(policy, env, 20))
policy.learn(6000)
print("after", evaluate_policy(policy, env, 20), time.time()-t)
