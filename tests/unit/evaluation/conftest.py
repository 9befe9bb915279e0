from ..folds.conftest import samples as samples
