"""Training configurations: the recipe of the authors' code, and those of a TOML file."""

import json

import pytest
from torch import nn

import afferents
from afferents.errors import InputError
from afferents.models.classifiers import build
from afferents.models.config import DROPOUT_LAYERS, Hyperparameters, training_config
from afferents.models.layers import l2_penalty, set_dropout


@pytest.mark.parametrize(
    ("recipe", "rate", "patience"),
    [("spatial-net", 1e-3, 20), ("cnn-lstm", 1e-4, 20), ("vibration-net", 1e-4, 10)],
)
def test_paper_is_the_recipe_of_the_authors_code(recipe, rate, patience):
    config = training_config("paper", recipe)
    assert (config.learning_rate, config.patience) == (rate, patience)
    assert (config.batch_size, config.max_epochs) == (64, 150)
    assert config.training_samples is None
    kept = training_config("paper", recipe, statistics="keras")
    assert config.warm_up_statistics
    assert kept == config.model_copy(update={"warm_up_statistics": False})


SHAPES = {"spatial-net": (19, 19), "cnn-lstm": (10, 19, 19), "vibration-net": (1, 200)}


def written(folder, text):
    path = folder / "mine.toml"
    path.write_text(text)
    return path


def test_tables_go_before_what_holds_for_all(tmp_path):
    path = written(
        tmp_path,
        "max_epochs = 40\npatience = 5\n[spatial-net]\nmax_epochs = 7\ndropout = [0.5, 0.5, 0.1]\n",
    )
    own = Hyperparameters.of(path, "paper")
    images, vibration = (
        training_config("paper", network, changed=own.changed[network])
        for network in ("spatial-net", "vibration-net")
    )
    assert (images.max_epochs, images.patience, images.learning_rate) == (7, 5, 1e-3)
    assert images.dropout == (0.5, 0.5, 0.1)
    assert (vibration.max_epochs, vibration.dropout) == (40, None)
    assert own.source == str(path)
    assert own.changed["cnn-lstm"] == {"max_epochs": 40, "patience": 5}
    json.dumps(own.changed)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("epochs = 4", "expected some of learning_rate, .*, found 'epochs'"),
        ("[spacial-net]\nmax_epochs = 4", r"tables named spatial-net, .*, found \[spacial-net\]"),
        ('device = "cuda"', "found 'device'; give it as --device"),
        ("learning_rate = -1", "learning_rate"),
        ("[cnn-lstm]\ndropout = [0.4, 0.2]", "one share, or 3, of the dropout layers .* found 2"),
        ("", "found nothing"),
        ("max_epochs = ", "a damaged file, no TOML"),
    ],
)
def test_what_makes_no_sense_is_one_sentence(tmp_path, text, sentence):
    with pytest.raises(InputError, match=sentence):
        Hyperparameters.of(written(tmp_path, text), "paper")
    with pytest.raises(InputError, match="no patience with one_cycle"):
        Hyperparameters.of({"patience": 3}, "fast")


@pytest.mark.parametrize("network", SHAPES)
def test_dropout_is_set_layer_by_layer_and_l2_by_its_factor(network):
    built = build(network, 3, SHAPES[network])
    layers = [one for one in built.modules() if isinstance(one, nn.Dropout)]
    assert len(layers) == DROPOUT_LAYERS[network]
    before = [one.p for one in layers]
    set_dropout(built, None)
    assert [one.p for one in layers] == before
    set_dropout(built, tuple(0.1 * (i + 1) for i in range(len(layers))))
    assert [one.p for one in layers] == [0.1 * (i + 1) for i in range(len(layers))]
    with pytest.raises(InputError, match="one for each of"):
        set_dropout(built, (0.1,) * 9)
    assert l2_penalty(built, 0.01).item() == pytest.approx(2 * l2_penalty(built).item())


def test_results_card_and_report_say_what_was_set(stores, tmp_path):
    own = {"spatial-net": {"max_epochs": 1, "l2": 0.02, "training_samples": 200}}
    asked = {"preset": "quick", "recipe": own, "quiet": True}
    results = afferents.evaluate(
        stores["video"], tmp_path / "r", "sa-se", held_out=[40.0], workers=1, **asked
    )
    assert results.summary["recipe"] == own
    assert results.config["recipe"] == own
    assert results.config["training"]["spatial-net"]["l2"] == 0.02
    (fold,) = (tmp_path / "r").rglob("fold.json")
    assert json.loads(fold.read_text())["epochs"] == 1
    page = afferents.report(tmp_path / "r", quiet=True).read_text()
    assert "Set otherwise: spatial-net" in page
    assert "max_epochs = 1, l2 = 0.02" in page
    card = afferents.train(
        stores["video"], tmp_path / "m", "sa-se", results=tmp_path / "r", **asked
    )
    assert card.recipe == own["spatial-net"] == card.scores[0].recipe
    assert "(preset quick but max_epochs = 1, l2 = 0.02, training_samples = 200)" in " ".join(
        card.describe()
    )
    with pytest.raises(InputError, match="recipe"):
        afferents.evaluate(
            stores["video"], tmp_path / "r", "sa-se", preset="quick", held_out=[40.0], quiet=True
        )


def test_a_recipe_for_no_model_is_refused(stores, tmp_path, fails):
    path = written(tmp_path, "[cnn-lstm]\nmax_epochs = 2\n")
    sentence = fails(
        "evaluate", stores["video"], "--out", tmp_path / "r", "--models", "sa-se", "--recipe", path
    )
    assert "--recipe for cnn-lstm: expected models that it is for (sa-ste, ra-ste" in sentence
    with pytest.raises(InputError, match="--recipe for cnn-lstm: expected models"):
        afferents.train(stores["video"], tmp_path / "m", "sa-wave", recipe=path, quiet=True)


def test_few_samples_are_gone_through_more_often_than_many():
    fast = training_config("fast", "spatial-net")
    assert [fast.epochs(n) for n in (48_000, 10_000, 10)] == [1, 5, 12]
    assert training_config("paper", "spatial-net").epochs(10) == 150
    given = Hyperparameters.of({"spatial-net": {"max_epochs": 30}}, "fast")
    own = training_config("fast", "spatial-net", given.changed["spatial-net"])
    assert own.epochs(48_000) == 30
