"""Environments: what Gymnasium itself checks, and that many give what one gives."""

import warnings

import numpy as np
import pytest

import mbody
from tests.support.many_motions import TASK, cart_pole

gymnasium = pytest.importorskip("gymnasium")


def test_gymnasium_finds_nothing_wrong(tmp_path):
    from gymnasium.utils.env_checker import check_env

    file = tmp_path / "cart_pole.toml"
    mbody.save(cart_pole(), file)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it recommends other bounds
        check_env(mbody.envs.make(file, **TASK), skip_render_check=True)


def test_the_reward_and_the_ends_are_those_of_a_simulator():
    env, sim = mbody.envs.make(cart_pole(), **TASK), mbody.Simulator(cart_pole(), rtol=1e-11)
    first, _ = env.reset(seed=4)
    sim.reset({"cart.x": float(env.sims["cart"].x[0]), "pole.angle": float(first[2])})
    ended = False
    for _ in range(60):
        observed, reward, ended, truncated, _ = env.step(np.array([3.0], dtype=np.float32))
        sim.inputs["u"] = 3.0
        sim.step(0.02)
        # float32, and the tolerance of the environment
        assert observed == pytest.approx(
            [sim.measure(one) for one in TASK["observations"]], abs=1e-4
        )
        assert reward == pytest.approx(np.cos(sim["pole"].angle), abs=1e-4)
        assert ended == (abs(sim["pole"].angle) > np.radians(24) or abs(sim["cart"].x) > 2.4)
        if ended or truncated:
            break
    assert ended and not truncated


def test_many_environments_give_what_each_gives():
    vec = mbody.envs.make_vec(cart_pole(), 20, **TASK)
    singles = [mbody.envs.make(cart_pole(), **TASK) for _ in range(2)]
    observed, _ = vec.reset(seed=3)
    for k, env in enumerate(singles):
        assert np.array_equal(env.reset(seed=3 + k)[0], observed[k])
    over, episodes, rng = [False, False], 0, np.random.default_rng(0)
    for _ in range(150):
        actions = rng.uniform(-10.0, 10.0, (20, 1)).astype(np.float32)
        observed, rewards, ended, truncated, _ = vec.step(actions)
        for k, env in enumerate(singles):
            if over[k]:
                one, reward, end, cut = env.reset()[0], 0.0, False, False
                episodes += 1
            else:
                one, reward, end, cut, _ = env.step(actions[k])
            over[k] = end or cut
            assert np.array_equal(one, observed[k])
            assert (reward, end, cut) == (rewards[k], ended[k], truncated[k])
    assert episodes >= 4


def test_the_vector_environment_has_the_spaces_of_gymnasium():
    vec = mbody.envs.make_vec(cart_pole(), 3, **TASK)
    assert vec.metadata["autoreset_mode"] is gymnasium.vector.AutoresetMode.NEXT_STEP
    observed, _ = vec.reset(seed=0)
    assert observed in vec.observation_space
    vec.action_space.seed(0)
    before = observed[1].copy()
    observed, *_ = vec.step(vec.action_space.sample())
    assert observed in vec.observation_space
    assert not np.array_equal(observed[1], before)
    mask = np.array([True, False, False])
    kept = observed[1:].copy()
    observed, _ = vec.reset(options={"reset_mask": mask})
    assert np.array_equal(observed[1:], kept) and (vec.sims.t > 0.0).tolist() == [False, True, True]


def test_a_motion_that_fails_ends_its_episode():
    machine = mbody.Mechanism("wheel")
    machine.add(
        mbody.Body("wheel", mass=1.0, inertia=0.1, cg=(0, 0), guess=0.0),
        mbody.Revolute("O", "ground", "wheel"),
        mbody.Input("u", "1 N*m"),
        mbody.Torque("motor", "wheel", value="u*sqrt(1 - wheel.angle)"),
    )
    how = {"actions": {"u": (-1.0, 1.0)}, "observations": "wheel.angle", "step": 2.0}
    env = mbody.envs.make(machine, reward={"wheel.angle^2": -1.0, "u": 0.5}, **how)
    env.reset(seed=0)
    _, reward, ended, _, info = env.step(np.array([1.0]))
    assert ended and "failed" in info and np.isfinite(reward)
    _, _ = env.reset()
    _, reward, ended, _, info = env.step(np.array([-1.0]))
    angle = float(env.sims["wheel"].angle[0])
    assert not ended and not info and reward == pytest.approx(-(angle**2) - 0.5)


def test_a_name_of_the_gallery():
    """As in the command, a name that is no file is one of the gallery."""
    how = {"actions": {"u": ("-10 N", "10 N")}, "observations": ["cart.x", "pole.angle"]}
    how |= {"reward": {"pole.angle^2": -1.0}, "step": "20 ms"}
    pair = [mbody.envs.make(m, **how) for m in ("cart_pole", mbody.gallery.path("cart_pole"))]
    first, second = (env.reset(seed=3)[0] for env in pair)
    assert np.array_equal(first, second)
    with pytest.raises(mbody.ModelError, match="the gallery has no model 'cart_pile'"):
        mbody.envs.make("cart_pile", **how)


def test_pictures_of_one_size_follow_what_moves():
    """The second independent look: the mechanism stands on the canvas however far it is."""
    pytest.importorskip("matplotlib")
    from gymnasium.utils.env_checker import check_env

    env = mbody.envs.make(cart_pole(), **TASK, render_mode="rgb_array")
    env.reset(seed=1)
    first = env.render()
    for _ in range(60):
        env.step(np.array([8.0], dtype=np.float32))
    assert env.sims["cart"].x[0] > 1.0  # the canvas shows some half a metre
    later = env.render()
    assert first.shape == later.shape and first.dtype == np.uint8
    ink = [np.argwhere((one < 250).any(axis=2)) for one in (first, later)]
    assert all(len(one) > 1000 and 100 < one[:, 1].mean() < 380 for one in ink)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_env(env)
    vec = mbody.envs.make_vec(cart_pole(), 2, **TASK, render_mode="rgb_array")
    vec.reset(seed=1)
    assert np.array_equal(vec.render()[0], first) and len(vec.render()) == 2
    assert mbody.envs.make(cart_pole(), **TASK).render() is None


def test_a_copied_input_keeps_its_unit():
    one, two = cart_pole(), mbody.Mechanism("copy")
    two.add(*one)
    assert two.inputs[0].dimension == one.inputs[0].dimension is not None
