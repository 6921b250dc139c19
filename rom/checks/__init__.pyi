from rom.checks.gates import check as check
from rom.checks.gates import check_body as check_body
from rom.checks.gates import check_model as check_model
